"""Time until an import, the first update of a training and a verdict are done."""

import os
import statistics
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from benchmarks.benchmark import Setup
from benchmarks.commands import PROGRAM, call

_IMPORT = "import time; t = time.perf_counter(); import {}; print(time.perf_counter() - t)"
_POLL_S = 0.005
"""Seconds between two checks for the first update."""


def bench_startup(setup: Setup) -> dict[str, float]:
    """Measure start-up times with cached kernels; medians of three.

    Returns:
        "import_s" of the package, "start_to_first_update_s" of `drone-rl train`, "first_compile_s"
        (additional time without cached kernels), "verdict_s" of `drone-rl verdict policy=good`
        with its 400 episodes; "import_torch_s", a measure of the machine's speed.
    """
    folder = setup.runs / "startup"
    times = range(1 if setup.quick else 3)
    import_seconds()  # compiles Python files
    first_update_seconds(folder / "warm", setup.device)  # compiles kernels
    cold = first_update_seconds(folder / "cold", setup.device, folder / "kernels")
    updates = [first_update_seconds(folder / f"update_{i}", setup.device) for i in times]
    verdicts = [verdict_seconds(folder / f"verdict_{i}", setup.device) for i in times]
    update_s = statistics.median(updates)
    return {
        "import_s": statistics.median(import_seconds() for _ in times),
        "start_to_first_update_s": update_s,
        "first_compile_s": cold - update_s,
        "verdict_s": statistics.median(verdicts),
        "import_torch_s": statistics.median(import_seconds("torch") for _ in times),
    }


def import_seconds(name: str = "drone_rl") -> float:
    """Return the seconds of an import in a new interpreter."""
    command = [sys.executable, "-c", _IMPORT.format(name)]
    return float(subprocess.run(command, capture_output=True, check=True).stdout)


def first_update_seconds(
    folder: Path, device: str, kernels: Path | None = None, settings: Sequence[str] = ()
) -> float:
    """Return the seconds from the start of `drone-rl train` to the first row of metrics.csv.

    Args:
        folder: Folder of the run.
        device: Device of the training.
        kernels: Folder of the kernel cache; Warp's default if None.
        settings: Further settings of the training.

    Raises:
        RuntimeError: The command ended without an update.
    """
    metrics, begin = folder / "metrics.csv", time.perf_counter()
    settings = [
        *settings,
        "trainer.total_frames=1",
        f"device={device}",
        f"hydra.run.dir={folder}",
    ]
    null = subprocess.DEVNULL
    cache = {} if kernels is None else {"WARP_CACHE_PATH": str(kernels)}
    process = subprocess.Popen(
        [*PROGRAM, "train", *settings], stdout=null, stderr=null, env={**os.environ, **cache}
    )
    while not (metrics.is_file() and metrics.stat().st_size):
        if process.poll() is not None:
            raise RuntimeError(f"drone-rl train ended with status {process.returncode}")
        time.sleep(_POLL_S)
    seconds = time.perf_counter() - begin
    process.wait()
    return seconds


def verdict_seconds(folder: Path, device: str) -> float:
    """Return the seconds of `drone-rl verdict policy=good`."""
    begin = time.perf_counter()
    call("verdict", "policy=good", f"device={device}", f"hydra.run.dir={folder}")
    return time.perf_counter() - begin
