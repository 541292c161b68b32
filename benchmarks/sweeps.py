"""Sweeps: speed-up of parallel runs, overhead of the launcher, kills, and the Ray collector."""

import contextlib
import csv
import importlib.util
import json
import os
import runpy
import signal
import statistics
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.commands import PROGRAM, call
from drone_rl.sweeps.manifest import THREADS
from drone_rl.training import CheckpointCallback, CsvCallback, LoggerCallback
from drone_rl.utils.checkpoint import load_checkpoint

_BARE = (sys.executable, "-m", "benchmarks.sweeps")


def bench_sweeps(folder: Path, device: str, quick: bool) -> dict[str, Any]:
    """Measure the same trainings as single commands, in a sweep, and in a sweep of two jobs.

    Single ("bare") trainings write no metrics, events and checkpoints before their end.

    Returns:
        Seconds of each, the speed-up of two parallel jobs, and the relative overhead of launcher
        and logging.
    """
    seeds, episodes = (2, 20) if quick else (4, 250)
    training = [
        "experiment=single_episode",
        "task=collect_one",
        f"trainer.total_episodes={episodes}",
        "trainer.target_share=null",
        f"device={device}",
    ]
    bare = sum(
        _seconds(_BARE, *training, f"seed={i}", f"hydra.run.dir={folder}/bare_{i}")
        for i in range(seeds)
    )
    one, two = (
        _seconds(
            PROGRAM,
            "-m",
            *training,
            f"seed=range({seeds})",
            f"hydra.launcher.num_jobs={jobs}",
            f"hydra.sweep.dir={folder}/sweep_{jobs}",
        )
        for jobs in (1, 2)
    )
    return {
        "sweep_bare_s": bare,
        "sweep_one_at_a_time_s": one,
        "sweep_two_at_once_s": two,
        "sweep_speedup": one / two,
        "launcher_overhead": one / bare - 1,
    }


def bench_kills(folder: Path, device: str, quick: bool) -> dict[str, Any]:
    """Run a sweep twice; kill the second one (SIGKILL) at three random times and resume it.

    Returns:
        The number of kills, the number of runs, and the number of runs with the same parameters
        and results in both sweeps.
    """
    count = 4 if quick else 12
    settings = [
        "experiment=smoke",
        "trainer.total_frames=4000",
        "trainer.checkpoint_interval_s=0.2",
        "evaluate_after=20",
        "logger=csv",
        f"seed=range({count})",
        f"device={device}",
    ]
    whole, killed = folder / "never_killed", folder / "killed"
    seconds = _seconds(PROGRAM, "-m", *settings, f"hydra.sweep.dir={whole}")
    again = (*PROGRAM, "train", "-m", *settings, f"hydra.sweep.dir={killed}")
    kills, delays = 0, np.random.default_rng(0).uniform(0.2, 1.0, 3) * seconds / 3
    for delay in delays:
        sweep = subprocess.Popen(again, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        with contextlib.suppress(subprocess.TimeoutExpired):
            sweep.wait(delay)
        kills += sweep.poll() is None
        _kill_processes(str(killed))
        sweep.wait()
    _seconds(PROGRAM, "-m", *settings, f"hydra.sweep.dir={killed}")
    same = [_outcome(run) == _outcome(killed / run.name) for run in sorted(whole.glob("[0-9]*"))]
    return {"sweep_kills": kills, "sweep_runs": count, "sweep_runs_same_after_kills": sum(same)}


def bench_ray(folder: Path, device: str, quick: bool) -> dict[str, Any]:
    """Compare the Ray collector with the default collector on the same cores.

    Returns:
        The median frames per second of both and the median of their ratio; None without Ray.
    """
    if importlib.util.find_spec("ray") is None:
        return {"ray_fps": None, "ray_over_plain": None}
    frames, rounds = (15_000, 1) if quick else (40_000, 3)
    rates: dict[str, list[float]] = {"episodes": [], "ray": []}
    for i in range(rounds):
        for name, found in rates.items():
            run = folder / f"{name}_{i}"
            settings = [
                f"collector={name}",
                f"trainer.total_frames={frames}",
                "trainer.target_share=null",
                "logger=csv",
            ]
            _seconds(PROGRAM, *settings, f"device={device}", f"hydra.run.dir={run}")
            found.append(_collected_rate(run / "metrics.csv"))
    ratios = [r / p for r, p in zip(rates["ray"], rates["episodes"], strict=True)]
    return {
        "plain_beside_ray_fps": statistics.median(rates["episodes"]),
        "ray_fps": statistics.median(rates["ray"]),
        "ray_over_plain": statistics.median(ratios),
    }


def _seconds(program: tuple[str, ...], *args: str) -> float:
    """Return the time of one command."""
    begin = time.perf_counter()
    call("train", *args, program=program, environment=THREADS)
    return time.perf_counter() - begin


def _kill_processes(text: str) -> None:
    """Kill every other process with a text in its command line."""
    for name in os.listdir("/proc"):
        with contextlib.suppress(OSError, ValueError):  # processes can end meanwhile
            pid, command = int(name), Path("/proc", name, "cmdline").read_bytes()
            if pid != os.getpid() and text.encode() in command:
                os.kill(pid, signal.SIGKILL)


def _outcome(run: Path) -> tuple[dict[str, Any], dict[str, list]]:
    """Return result and parameters of a run, without time and verdict (which has a fresh seed)."""
    result = json.loads((run / "result.json").read_text())
    del result["seconds"]
    result.pop("verdict", None)
    policy = load_checkpoint(run / "checkpoints" / "last.pt")["policy"]
    return result, {name: values.tolist() for name, values in policy.items()}


def _collected_rate(path: Path) -> float:
    """Return the frames per second of collection, without the first batch (it starts workers)."""
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))
    seconds = sum(float(row["time/collect_s"]) for row in rows[1:])
    return (int(rows[-1]["frames"]) - int(rows[0]["frames"])) / seconds


def _train_bare() -> None:
    """Run `drone-rl` without writing files between the first and the last update."""
    for callback in (CsvCallback, LoggerCallback, CheckpointCallback):
        setattr(callback, "on_update", lambda *_: None)  # noqa: B010 (a method replaced on purpose)
    runpy.run_module("drone_rl.cli.main", run_name="__main__", alter_sys=True)


if __name__ == "__main__":
    _train_bare()
