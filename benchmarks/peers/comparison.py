"""Our learners and what a user would pick instead, one after the other on the same machine."""

import functools
import json
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from benchmarks.commands import train
from benchmarks.peers.plot import plot
from benchmarks.peers.program import success_lower95
from benchmarks.peers.settings import OURS, THEIRS

Measured = dict[str, Any]


def bench_peers(folder: Path, seeds: Sequence[int], episodes: int, quick: bool) -> dict[str, Any]:
    """Trains with each from each seed until it is solved, and judges by held-out episodes.

    Ours is the whole command, its end and its files included; of a peer, what comes after it is
    solved does not count. Each is started once beforehand, so that none reads files from the disk
    for the others; and all of a seed come one after the other, so that a machine that becomes
    slower does so for all.

    Args:
        folder: For the runs, and above it for the picture.
        seeds: Of worlds, weights and actions.
        episodes: Held-out ones.
        quick: Whether a few frames will do.

    Returns:
        "peers": by name, lists by seed of "seconds" from the start of the process,
        "seconds_without_imports", "frames", "is_solved", "success_lower95".
        "solve_over_best_peer": the mean of our default's "seconds" over the best other's.
    """
    if not quick:  # or the first would read all files from the disk for the others
        for start in _trainings(folder / "starts", 0, quick=True).values():
            start(seed=seeds[0])
    trainings = _trainings(folder, episodes, quick)
    found: dict[str, dict[str, list]] = {name: {} for name in trainings}
    for seed in seeds[:1] if quick else seeds:
        for name, measure in trainings.items():
            for key, value in measure(seed=seed).items():
                found[name].setdefault(key, []).append(value)
    plot(found, folder.parent.parent / "peers.png")
    means = {name: statistics.mean(values["seconds"]) for name, values in found.items()}
    best = min(means[name] for name in THEIRS)
    return {"peers": found, "solve_over_best_peer": means["reinforce"] / best}


def _trainings(folder: Path, episodes: int, quick: bool) -> dict[str, Callable[..., Measured]]:
    """A training by each, of a seed."""
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
    """One training by `drone-rl train`.

    Args:
        arguments: Of the command.
        seed: Of worlds, weights and actions.
        episodes: Held-out ones to fly afterwards; 0 for none.
        folder: For the runs.
    """
    run = folder / str(seed)
    seconds, result = train(run, *arguments, f"seed={seed}")
    found = {
        "seconds": seconds,
        "seconds_without_imports": result["seconds"],
        "frames": result["frames"],
        "is_solved": result["reason"] == "solved",
    }
    return found | ({"success_lower95": success_lower95(run, episodes)} if episodes else {})


def train_theirs(
    name: str, settings: Mapping[str, Any], *, seed: int, episodes: int, max_frames: int
) -> Measured:
    """One training by others.

    Args:
        name: Of the peer.
        settings: Of it.
        seed: Of worlds, weights and actions.
        episodes: Held-out ones to fly afterwards; 0 for none.
        max_frames: It stops after so many in any case.

    Raises:
        RuntimeError: It failed.
    """
    options = {"seed": seed, "episodes": episodes, "max-frames": max_frames}
    options |= {"settings": json.dumps(dict(settings)), "started": time.time()}
    words = [f"--{key}={value}" for key, value in options.items()]
    program = [sys.executable, "-m", "benchmarks.peers.program", name]
    done = subprocess.run([*program, *words], capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"{name} failed: {done.stderr.strip()[-500:]}")
    return json.loads(done.stdout.splitlines()[-1])
