"""Memory of a whole training: its peak and its growth."""

import gc
import json
import os
import subprocess
import sys
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from benchmarks.benchmark import Setup
from benchmarks.commands import memory_status
from drone_rl.utils.unloaded_compiler import leave_compiler_unloaded

SETTLING_FRAMES = 100_000
"""Frames after which a training has met all batch lengths and numbers of active environments."""


def bench_memory(setup: Setup) -> dict[str, Any]:
    """Train in a separate process without a target and record its resident memory.

    Returns:
        The peak (MiB) and the growth (MiB per million frames).

    Raises:
        RuntimeError: The training failed.
    """
    folder = setup.runs
    settling, frames = 1_000 if setup.quick else SETTLING_FRAMES, setup.memory_frames
    arguments = [str(folder / "memory"), str(settling + frames), setup.device]
    command = [sys.executable, "-m", __name__, *arguments]
    process = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    if process.returncode != 0:
        raise RuntimeError(
            f"the training of the memory benchmark failed: status {process.returncode}"
        )
    measured = json.loads(process.stdout)
    return {
        "peak_memory_mib": measured["peak"],
        "memory_growth_mib_per_million_frames": growth(measured["samples"], settling),
        "memory_frames": frames,
    }


def growth(samples: Sequence[tuple[int, float]], settling: int) -> float | None:
    """Return the slope of a straight line fitted to the resident memory after each update.

    Args:
        samples: Pairs of frames and resident memory (MiB).
        settling: Samples before this number of frames are ignored.

    Returns:
        MiB per million frames; None if there are fewer than 3 samples.
    """
    settled = np.array([s for s in samples if s[0] >= settling])
    if len(settled) < 3:
        return None
    return float(np.polyfit(settled[:, 0], settled[:, 1], 1)[0]) * 1e6


def main(folder: str, frames: str, device: str) -> None:
    """Train as `drone-rl train` does and print the resident memory after each update."""
    gc.set_threshold(50_000, 50, 100)
    os.environ.setdefault("ONEDNN_PRIMITIVE_CACHE_CAPACITY", "128")
    leave_compiler_unloaded()
    import drone_rl
    from drone_rl.config.training import TrainerSettings
    from drone_rl.training import Callback
    from drone_rl.training.callbacks import OngoingTraining
    from drone_rl.utils.memory import return_freed_memory

    samples: list[tuple[int, float]] = []

    class RecordMemory(Callback):
        """Record the resident memory after each update; within one it varies by 100 MiB."""

        def on_update(self, training: OngoingTraining, metrics: Mapping[str, float]) -> None:
            return_freed_memory()
            samples.append((training.progress.frames, memory_status(os.getpid())["VmRSS"]))

    limits = TrainerSettings(target_share=None, total_frames=int(frames))
    drone_rl.train(folder=folder, trainer=limits, device=device, callbacks=[RecordMemory()])
    peak = memory_status(os.getpid())["VmHWM"]
    print(json.dumps({"peak": peak, "samples": samples}))  # noqa: T201 -- the parent process reads it


if __name__ == "__main__":
    main(*sys.argv[1:])
