"""What sweeps gain, cost and survive: two runs at once, the launcher, kills, the Ray collector."""

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
    """Times the same trainings bare and alone, in a sweep one at a time, and two at once.

    Bare trainings write no metrics, no events and no checkpoints on their way.

    Returns:
        Seconds of each, trainings an hour two at once over one at a time, and the share of time
        that launcher and logging add to the bare trainings.
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
    """Runs a sweep twice, the second time killed (kill -9) at three random moments.

    Returns:
        How often it was killed, and how many of its runs ended with the same parameters and the
        same result as in the sweep that was never killed.
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
    kills, moments = 0, np.random.default_rng(0).uniform(0.2, 1.0, 3) * seconds / 3
    for moment in moments:
        sweep = subprocess.Popen(again, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        with contextlib.suppress(subprocess.TimeoutExpired):
            sweep.wait(moment)
        kills += sweep.poll() is None
        _kill_all_that_name(str(killed))
        sweep.wait()
    _seconds(PROGRAM, "-m", *settings, f"hydra.sweep.dir={killed}")
    same = [_outcome(run) == _outcome(killed / run.name) for run in sorted(whole.glob("[0-9]*"))]
    return {"sweep_kills": kills, "sweep_runs": count, "sweep_runs_same_after_kills": sum(same)}


def bench_ray(folder: Path, device: str, quick: bool) -> dict[str, Any]:
    """Frames a second of the Ray collector over the plain one, on the same two cores.

    Returns:
        The median rates and the median of their ratio; None where Ray isn't installed.
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
    """Time of one command."""
    begin = time.perf_counter()
    call("train", *args, program=program, environment=THREADS)
    return time.perf_counter() - begin


def _kill_all_that_name(words: str) -> None:
    """Ends (kill -9) every process with these words on its command line, but for this one."""
    for name in os.listdir("/proc"):  # what ends meanwhile has no file any more
        with contextlib.suppress(OSError, ValueError):
            number, said = int(name), Path("/proc", name, "cmdline").read_bytes()
            if number != os.getpid() and words.encode() in said:
                os.kill(number, signal.SIGKILL)


def _outcome(run: Path) -> tuple[dict[str, Any], dict[str, list]]:
    """What a run came to, but for the time it took and its verdict, whose seed is fresh."""
    result = json.loads((run / "result.json").read_text())
    del result["seconds"]
    result.pop("verdict", None)
    policy = load_checkpoint(run / "checkpoints" / "last.pt")["policy"]
    return result, {name: values.tolist() for name, values in policy.items()}


def _collected_rate(path: Path) -> float:
    """Frames a second of collecting alone, without the first batch, which starts the workers."""
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))
    seconds = sum(float(row["time/collect_s"]) for row in rows[1:])
    return (int(rows[-1]["frames"]) - int(rows[0]["frames"])) / seconds


def _train_bare() -> None:
    """`drone-rl` with nothing written between the first and the last update."""
    for callback in (CsvCallback, LoggerCallback, CheckpointCallback):
        setattr(callback, "on_update", lambda *_: None)  # noqa: B010 (a method replaced on purpose)
    runpy.run_module("drone_rl.cli.main", run_name="__main__", alter_sys=True)


if __name__ == "__main__":
    _train_bare()
