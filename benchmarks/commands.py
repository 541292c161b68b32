"""Run commands of `drone-rl` in separate processes, as a user does."""

import os
import subprocess
import time
from collections.abc import Mapping
from pathlib import Path

from drone_rl.sweeps.executors import PROGRAM
from drone_rl.utils.run_result import NAME, RunResult


def call(
    *args: str,
    statuses: tuple[int, ...] = (0,),
    environment: Mapping[str, str] | None = None,
    tree: Path | None = None,
    folder: Path | None = None,
) -> None:
    """Run `drone-rl`.

    Args:
        args: Arguments of the command.
        statuses: Exit statuses that count as success.
        environment: Additional environment variables.
        tree: Checkout whose code runs, in its folder; by default that of this program, here.
        folder: Working folder in which the code of this program runs.

    Raises:
        RuntimeError: The exit status is not in `statuses`.
    """
    code = tree if folder is None else Path(__file__).parents[1]
    python_path = {} if code is None else {"PYTHONPATH": str(code)}
    process = subprocess.run(
        [*PROGRAM, *args],
        capture_output=True,
        text=True,
        check=False,
        cwd=folder or tree,
        env={**os.environ, **python_path, **(environment or {})},
    )
    if process.returncode not in statuses:
        raise RuntimeError(f"drone-rl {' '.join(args)} failed: {process.stderr.strip()[-500:]}")


def train(
    run: Path, *args: str, environment: Mapping[str, str] | None = None
) -> tuple[float, RunResult]:
    """Run `drone-rl train`.

    Args:
        run: Folder of the run.
        args: Overrides.
        environment: Additional environment variables.

    Returns:
        Seconds from the start of the command to its end, and its result.

    Raises:
        RuntimeError: The command failed.
    """
    begin = time.perf_counter()
    call("train", *args, f"hydra.run.dir={run}", environment=environment)
    return time.perf_counter() - begin, RunResult.read_json(run / NAME)


def watch(*args: str) -> tuple[float, float]:
    """Run `drone-rl` and monitor its memory.

    Returns:
        Seconds from start to end, and peak resident memory (MiB).

    Raises:
        RuntimeError: The command failed.
    """
    begin, peak = time.perf_counter(), 0.0
    process = subprocess.Popen(
        [*PROGRAM, *args], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    while process.poll() is None:
        peak = max(peak, memory_status(process.pid).get("VmHWM", 0.0))
        time.sleep(0.1)
    if process.returncode != 0:
        raise RuntimeError(f"drone-rl {' '.join(args)} failed: status {process.returncode}")
    return time.perf_counter() - begin, peak


def memory_status(pid: int) -> dict[str, float]:
    """Return the "Vm..." fields of /proc/PID/status in MiB; empty if the process has ended."""
    try:
        lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    except OSError:
        return {}
    fields = (line.split() for line in lines if line.startswith("Vm"))
    return {name.rstrip(":"): float(kib) / 1024 for name, kib, *_ in fields}
