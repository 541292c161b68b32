"""How long a user waits: for an import, for the first update of a training, for a verdict."""

import os
import statistics
import subprocess
import sys
import time
from pathlib import Path

from benchmarks.commands import PROGRAM, call

_IMPORT = "import time; t = time.perf_counter(); import {}; print(time.perf_counter() - t)"
TORCH_S = 1.0
"""Of `import torch` on the machine for which the figures were asked."""
_LOOK_S = 0.005
"""Time between two looks for the first update."""


def bench_startup(folder: Path, device: str, quick: bool) -> dict[str, float]:
    """Seconds from the start of a command to what it is for, kernels cached; medians of three.

    Args:
        folder: Where the commands work.
        device: Where they draw.
        quick: Whether once is enough.

    Returns:
        "import_s" of the package alone, "start_to_first_update_s" of `drone-rl train`,
        "first_compile_s" that the same takes longer where no kernels are cached, "verdict_s"
        of `drone-rl verdict policy=good`, with its 400 episodes; "import_torch_s", which tells how
        fast the machine is, and the three times as they would be where that takes 1 s.
    """
    times = range(1 if quick else 3)
    import_seconds()  # the first one compiles Python's files
    first_update_seconds(folder / "warm", device)  # and this one the kernels
    cold = first_update_seconds(folder / "cold", device, folder / "kernels")
    updates = [first_update_seconds(folder / f"update_{i}", device) for i in times]
    verdicts = [verdict_seconds(folder / f"verdict_{i}", device) for i in times]
    torch_s = statistics.median(import_seconds("torch") for _ in times)
    update_s, verdict_s = statistics.median(updates), statistics.median(verdicts)
    return {
        "import_s": statistics.median(import_seconds() for _ in times),
        "start_to_first_update_s": update_s,
        "first_compile_s": cold - update_s,
        "verdict_s": verdict_s,
        "import_torch_s": torch_s,
        "start_to_first_update_scaled_s": update_s * TORCH_S / torch_s,
        "first_compile_scaled_s": (cold - update_s) * TORCH_S / torch_s,
        "verdict_scaled_s": verdict_s * TORCH_S / torch_s,
    }


def import_seconds(name: str = "drone_rl") -> float:
    """Of an import in a fresh interpreter."""
    command = [sys.executable, "-c", _IMPORT.format(name)]
    return float(subprocess.run(command, capture_output=True, check=True).stdout)


def first_update_seconds(folder: Path, device: str, kernels: Path | None = None) -> float:
    """Of `drone-rl train`, until metrics.csv tells of an update.

    Args:
        folder: Its own.
        device: Where it draws.
        kernels: Folder of the cache of kernels; the usual one by default.

    Raises:
        RuntimeError: It ended without one.
    """
    metrics, begin = folder / "metrics.csv", time.perf_counter()
    told = ["trainer.total_frames=1", f"device={device}", f"hydra.run.dir={folder}"]
    nowhere = subprocess.DEVNULL
    cache = {} if kernels is None else {"WARP_CACHE_PATH": str(kernels)}
    process = subprocess.Popen(
        [*PROGRAM, "train", *told], stdout=nowhere, stderr=nowhere, env={**os.environ, **cache}
    )
    while not (metrics.is_file() and metrics.stat().st_size):
        if process.poll() is not None:
            raise RuntimeError(f"drone-rl train ended with status {process.returncode}")
        time.sleep(_LOOK_S)
    seconds = time.perf_counter() - begin
    process.wait()
    return seconds


def verdict_seconds(folder: Path, device: str) -> float:
    """Of `drone-rl verdict policy=good`."""
    begin = time.perf_counter()
    call("verdict", "policy=good", f"device={device}", f"hydra.run.dir={folder}")
    return time.perf_counter() - begin
