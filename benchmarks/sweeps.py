"""Sweeps: speed-up of parallel runs, and kills."""

import contextlib
import os
import signal
import subprocess
import time
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.benchmark import Setup
from benchmarks.commands import PROGRAM, call
from drone_rl.sweeps.manifest import THREADS
from drone_rl.utils.checkpoint import load_checkpoint
from drone_rl.utils.run_result import NAME, RunResult


def bench_sweeps(setup: Setup) -> dict[str, Any]:
    """Measure the same trainings in a sweep one at a time and two at a time.

    Returns:
        Seconds of each, and the speed-up of two parallel jobs.
    """
    folder = setup.runs
    seeds, episodes = (2, 20) if setup.quick else (4, 250)
    training = [
        "experiment=single_episode",
        "task=collect_one",
        f"trainer.total_episodes={episodes}",
        "trainer.target_share=null",
        f"device={setup.device}",
    ]
    one, two = (
        _seconds(
            "-m",
            *training,
            f"seed=range({seeds})",
            f"hydra.launcher.num_jobs={jobs}",
            f"hydra.sweep.dir={folder}/sweep_{jobs}",
        )
        for jobs in (1, 2)
    )
    return {
        "sweep_one_at_a_time_s": one,
        "sweep_two_at_once_s": two,
        "sweep_speedup": one / two,
    }


def bench_kills(setup: Setup) -> dict[str, Any]:
    """Run a sweep twice; kill the second one (SIGKILL) at three random times and resume it.

    Returns:
        The number of kills, the number of runs, and the number of runs with the same parameters
        and results in both sweeps.
    """
    folder = setup.runs
    count = 4 if setup.quick else 12
    settings = [
        "experiment=smoke",
        "trainer.total_frames=4000",
        "trainer.checkpoint_interval_s=0.2",
        "evaluate_after=20",
        "logger=csv",
        f"seed=range({count})",
        f"device={setup.device}",
    ]
    whole, killed = folder / "never_killed", folder / "killed"
    seconds = _seconds("-m", *settings, f"hydra.sweep.dir={whole}")
    again = (*PROGRAM, "train", "-m", *settings, f"hydra.sweep.dir={killed}")
    kills, delays = 0, np.random.default_rng(0).uniform(0.2, 1.0, 3) * seconds / 3
    for delay in delays:
        sweep = subprocess.Popen(again, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        with contextlib.suppress(subprocess.TimeoutExpired):
            sweep.wait(delay)
        kills += sweep.poll() is None
        _kill_processes(str(killed))
        sweep.wait()
    _seconds("-m", *settings, f"hydra.sweep.dir={killed}")
    same = [_outcome(run) == _outcome(killed / run.name) for run in sorted(whole.glob("[0-9]*"))]
    return {"sweep_kills": kills, "sweep_runs": count, "sweep_runs_same_after_kills": sum(same)}


def _seconds(*args: str) -> float:
    """Return the time of one command."""
    begin = time.perf_counter()
    call("train", *args, environment=THREADS)
    return time.perf_counter() - begin


def _kill_processes(text: str) -> None:
    """Kill every other process with a text in its command line."""
    for name in os.listdir("/proc"):
        with contextlib.suppress(OSError, ValueError):  # processes can end meanwhile
            pid, command = int(name), Path("/proc", name, "cmdline").read_bytes()
            if pid != os.getpid() and text.encode() in command:
                os.kill(pid, signal.SIGKILL)


def _outcome(run: Path) -> tuple[RunResult, dict[str, list]]:
    """Return result and parameters of a run, without time and verdict (which has a fresh seed)."""
    result = RunResult.read_json(run / NAME).replace(seconds=0.0, verdict=None)
    policy = load_checkpoint(run / "checkpoints" / "last.pt")["policy"]
    return result, {name: values.tolist() for name, values in policy.items()}
