"""Memory of a whole training: its peak, and what is never given back."""

import json
import os
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.commands import memory_status
from drone_rl.utils.imports import leave_compiler_unloaded
from drone_rl.utils.memory import look_for_garbage_rarely

SETTLING_FRAMES = 100_000
"""After which a training has seen what it will see: numbers of worlds, lengths of batches."""


def bench_memory(folder: Path, frames: int, device: str, quick: bool) -> dict[str, Any]:
    """Trains on past the target, in a process of its own that watches its resident memory.

    Args:
        folder: For the run.
        frames: Over which memory must stay flat, after the first `SETTLING_FRAMES`.
        device: Where to train.
        quick: Whether a few thousand will do.

    Returns:
        The peak, and the growth.

    Raises:
        RuntimeError: The training failed.
    """
    settling, frames = (1_000, 40_000) if quick else (SETTLING_FRAMES, frames)
    given = [sys.executable, "-m", __name__, str(folder / "memory"), str(settling + frames), device]
    done = subprocess.run(given, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    if done.returncode != 0:
        raise RuntimeError(f"the training for the memory benchmark failed: {done.returncode}")
    noted = json.loads(done.stdout)
    return {
        "peak_memory_mib": noted["peak"],
        "memory_growth_mib_per_million_frames": growth(noted["samples"], settling),
        "memory_frames": frames,
    }


def growth(samples: Sequence[tuple[int, float]], settling: int) -> float | None:
    """Slope of the line through what is resident between two updates, once that has settled.

    Args:
        samples: Frames and resident memory, MiB.
        settling: Frames before which a sample does not count.

    Returns:
        MiB for a million frames; None where there are too few samples.
    """
    settled = np.array([s for s in samples if s[0] >= settling])
    if len(settled) < 3:
        return None
    return float(np.polyfit(settled[:, 0], settled[:, 1], 1)[0]) * 1e6


def main(folder: str, frames: str, device: str) -> None:
    """Trains as `drone-rl train` does, and prints what was resident after each update."""
    look_for_garbage_rarely()
    leave_compiler_unloaded()
    import drone_rl
    from drone_rl.config.training import TrainerSettings
    from drone_rl.training import Callback
    from drone_rl.training.callbacks import OngoingTraining
    from drone_rl.utils.memory import return_freed_memory

    samples: list[tuple[int, float]] = []

    class Note(Callback):
        """What stays when an update is over: within one, memory swings by a hundred MiB."""

        def on_update(self, training: OngoingTraining, metrics: Mapping[str, float]) -> None:
            return_freed_memory()
            samples.append((training.progress.frames, memory_status(os.getpid())["VmRSS"]))

    limits = TrainerSettings(target_share=None, total_frames=int(frames))
    drone_rl.train(folder=folder, trainer=limits, device=device, callbacks=[Note()])
    peak = memory_status(os.getpid())["VmHWM"]
    print(json.dumps({"peak": peak, "samples": samples}))  # noqa: T201 -- what it is for


if __name__ == "__main__":
    main(*sys.argv[1:])
