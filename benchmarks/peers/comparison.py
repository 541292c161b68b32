"""Compare this project's learners with third-party learners on the same machine."""

import functools
import json
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from benchmarks.benchmark import Setup
from benchmarks.commands import train
from benchmarks.peers.plot import plot
from benchmarks.peers.program import success_lower95
from benchmarks.peers.settings import OURS, THEIRS
from drone_rl.training.run_folder import Training

Measured = dict[str, Any]


def bench_peers(setup: Setup) -> dict[str, Any]:
    """Train each learner from each seed until solved, and evaluate it on held-out episodes.

    The time of this project's learners is that of the whole command with all its files. The time of
    a third-party training ends when the task is solved. Each learner is started once beforehand, so
    that all have their files in the disk cache. The learners alternate for each seed, so that a
    drift of the machine's speed affects all of them.

    Returns:
        "peers": by name, lists by seed of "seconds" from the start of the process,
        "seconds_without_imports", "frames", "is_solved", "success_lower95".
        "solve_over_best_peer": mean "seconds" of the default divided by that of the fastest
        third-party learner.
    """
    folder = setup.runs / "peers"
    if not setup.quick:  # fill the disk cache
        for start in _trainings(folder / "starts", 0, quick=True).values():
            start(seed=setup.seeds[0])
    trainings = _trainings(folder, setup.episodes, setup.quick)
    measured: dict[str, dict[str, list]] = {name: {} for name in trainings}
    for seed in setup.seeds[:3]:
        for name, measure in trainings.items():
            for key, value in measure(seed=seed).items():
                measured[name].setdefault(key, []).append(value)
    plot(
        {name: values.pop("curve") for name, values in measured.items()},
        folder.parent.parent / "peers.png",
    )
    means = {name: statistics.mean(values["seconds"]) for name, values in measured.items()}
    best = min(means[name] for name in THEIRS)
    return {"peers": measured, "solve_over_best_peer": means["reinforce"] / best}


def _trainings(folder: Path, episodes: int, quick: bool) -> dict[str, Callable[..., Measured]]:
    """Return functions that train with each learner from a seed."""
    trainings: dict[str, Callable[..., Measured]] = {}
    for name, arguments in OURS.items():
        short = ("trainer.total_frames=1",) if quick else ()
        trainings[name] = functools.partial(
            train_ours, (*arguments, *short), episodes=episodes, folder=folder / name
        )
    for name, settings in THEIRS.items():
        most = 1 if quick else 1_000_000
        trainings[name] = functools.partial(
            train_theirs, name, settings, episodes=episodes, max_frames=most
        )
    return trainings


def train_ours(arguments: Sequence[str], *, seed: int, episodes: int, folder: Path) -> Measured:
    """Run one training by `drone-rl train`.

    Args:
        arguments: Overrides of the command.
        seed: Seed of environments, weights and actions.
        episodes: Number of held-out episodes; 0 for no evaluation.
        folder: Folder of the runs.

    Returns:
        As `benchmarks.peers.program` prints. The curve includes the time for writing files in that
        of the start.
    """
    run = folder / str(seed)
    seconds, result = train(run, *arguments, f"seed={seed}")
    columns, start = Training(run, result).metrics(), seconds - result.seconds
    ends = [start + at for at in columns["seconds"]]
    measured = {
        "seconds": seconds,
        "seconds_without_imports": result.seconds,
        "frames": result.frames,
        "is_solved": result.reason == "solved",
        "curve": [*zip(ends, columns["train/running_reward"], strict=True)],
    }
    return measured | ({"success_lower95": success_lower95(run, episodes)} if episodes else {})


def train_theirs(
    name: str, settings: Mapping[str, Any], *, seed: int, episodes: int, max_frames: int
) -> Measured:
    """Run one third-party training.

    Args:
        name: Name of the learner.
        settings: Settings of the learner.
        seed: Seed of environments, weights and actions.
        episodes: Number of held-out episodes; 0 for no evaluation.
        max_frames: Stop after this number of frames in any case.

    Raises:
        RuntimeError: The training failed.
    """
    options = {"seed": seed, "episodes": episodes, "max-frames": max_frames}
    options |= {"settings": json.dumps(dict(settings)), "started": time.time()}
    arguments = [f"--{key}={value}" for key, value in options.items()]
    program = [sys.executable, "-m", "benchmarks.peers.program", name]
    done = subprocess.run([*program, *arguments], capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"{name} failed: {done.stderr.strip()[-500:]}")
    return json.loads(done.stdout.splitlines()[-1])
