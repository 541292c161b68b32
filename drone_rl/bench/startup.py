"""How long a user waits: for an import, for the first update of a training, for a verdict."""

import statistics
import subprocess
import sys
import time
from pathlib import Path

from drone_rl.bench.commands import PROGRAM, call

_IMPORT = "import time; t = time.perf_counter(); import drone_rl; print(time.perf_counter() - t)"
_LOOK_S = 0.005
"""Time between two looks for the first update."""


def bench_startup(folder: Path, device: str, quick: bool) -> dict[str, float]:
    """Seconds from the start of a command to what it is for, kernels cached; medians of three.

    Args:
        folder: Where the commands work.
        device: Where they draw.
        quick: Whether once is enough.

    Returns:
        "import_s" of the package alone, "start_to_first_update_s" of `drone-rl train`, "verdict_s"
        of `drone-rl verdict policy=good`, with its 400 episodes.
    """
    times = range(1 if quick else 3)
    import_seconds()  # the first one compiles Python's files
    first_update_seconds(folder / "warm", device)  # and this one the kernels
    updates = [first_update_seconds(folder / f"update_{i}", device) for i in times]
    verdicts = [verdict_seconds(folder / f"verdict_{i}", device) for i in times]
    return {
        "import_s": statistics.median(import_seconds() for _ in times),
        "start_to_first_update_s": statistics.median(updates),
        "verdict_s": statistics.median(verdicts),
    }


def import_seconds() -> float:
    """Of `import drone_rl` in a fresh interpreter."""
    done = subprocess.run([sys.executable, "-c", _IMPORT], capture_output=True, check=True)
    return float(done.stdout)


def first_update_seconds(folder: Path, device: str) -> float:
    """Of `drone-rl train`, until metrics.csv tells of an update.

    Raises:
        RuntimeError: It ended without one.
    """
    metrics, begin = folder / "metrics.csv", time.perf_counter()
    told = ["trainer.total_frames=1", f"device={device}", f"hydra.run.dir={folder}"]
    nowhere = subprocess.DEVNULL
    process = subprocess.Popen([*PROGRAM, "train", *told], stdout=nowhere, stderr=nowhere)
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
