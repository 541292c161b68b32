"""Whole trainings by the commands that a user runs: time to solve, and success rate."""

import json
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.commands import call, train


def bench_solve(
    folder: Path, seeds: Sequence[int], episodes: int, device: str, quick: bool
) -> dict[str, Any]:
    """Train the default from each seed and evaluate the greedy policies.

    Returns:
        For each seed the seconds and frames until the command ends, and the lower bound of the
        exact 95% interval of the success rate; the median seconds; the number of seeds that
        reached the target; "learning_fps", the median frames per second of collection and updates
        together.
    """
    tried = seeds[:1] if quick else seeds
    settings = ["experiment=smoke"] if quick else []
    done = train_and_evaluate(folder, tried, settings, 50 if quick else episodes, device)
    return {
        "time_to_solve_s": done["seconds"],
        "frames_to_solve": done["frames"],
        "learning_fps": float(np.median(np.divide(done["frames"], done["trained_s"]))),
        "success_lower95": done["lower95"],
        "median_time_to_solve_s": float(np.median(done["seconds"])),
        "seeds_solved": done["reason"].count("solved"),
        "seeds_tried": len(tried),
    }


def bench_seeds(folder: Path, device: str, quick: bool) -> dict[str, Any]:
    """Train the default from 20 seeds that selected no setting, and evaluate the policies.

    Returns:
        The number of seeds that reach the target; for each seed the seconds and frames until the
        command ends, and the lower bound of the success rate in 1,000 episodes.
    """
    tried, settings = (range(2), ["experiment=smoke"]) if quick else (range(200, 220), [])
    done = train_and_evaluate(folder, tried, settings, 50 if quick else 1000, device)
    return {
        "seeds_solved_of_20": done["reason"].count("solved"),
        "seeds_s": done["seconds"],
        "seeds_frames": done["frames"],
        "seeds_lower95": done["lower95"],
    }


def bench_large(folder: Path, device: str, quick: bool) -> dict[str, Any]:
    """Train `experiment=large` for a fixed number of frames.

    Returns:
        Frames per second of collection and updates together, with cached kernels.
    """
    frames = 500 if quick else 20_000
    limits = (f"trainer.total_frames={frames}", "trainer.target_share=null")
    train(folder / "large_first", "experiment=large", f"device={device}", *limits)
    _, result = train(folder / "large", "experiment=large", f"device={device}", *limits)
    return {"learning_fps_large": result["frames"] / result["seconds"]}


def bench_pillars(
    folder: Path, seeds: Sequence[int], episodes: int, device: str, quick: bool
) -> dict[str, Any]:
    """Train `experiment=pillars` from each seed and evaluate the greedy policies.

    Returns:
        For each seed "pillars_train_s", seconds until the command ends, "pillars_frames", and
        "pillars_lower95" of the rate of held-out episodes that cross the line without touching a
        pillar; "pillars_solved", the number of seeds that reached the target.
    """
    tried = seeds[:1] if quick else seeds
    settings = ["experiment=pillars", *(["trainer.total_frames=4000"] if quick else [])]
    done = train_and_evaluate(folder, tried, settings, 50 if quick else episodes, device)
    return {
        "pillars_train_s": done["seconds"],
        "pillars_frames": done["frames"],
        "pillars_lower95": done["lower95"],
        "pillars_solved": done["reason"].count("solved"),
    }


def train_and_evaluate(
    folder: Path, seeds: Sequence[int], settings: Iterable[str], episodes: int, device: str
) -> dict[str, list]:
    """Train from each seed and evaluate each policy, by the commands that a user runs.

    Args:
        folder: Folder of the runs.
        seeds: Seeds of the trainings.
        settings: Overrides of every training.
        episodes: Held-out episodes of each policy.
        device: Device of training and evaluation.

    Returns:
        Lists with a value for each seed: "seconds" of the command, "frames", "trained_s" (seconds
        of the training loop), "reason" and "lower95".
    """
    names = ("seconds", "frames", "trained_s", "reason", "lower95")
    results: dict[str, list] = {name: [] for name in names}
    for seed in seeds:
        run = folder / f"train_{seed}"
        seconds, result = train(run, f"seed={seed}", f"device={device}", *settings)
        results["seconds"].append(seconds)
        results["frames"].append(result["frames"])
        results["trained_s"].append(result["seconds"])
        results["reason"].append(result["reason"])
        results["lower95"].append(evaluate(run, episodes, device)["lower95"])
    return results


def evaluate(run: Path, episodes: int, device: str) -> dict[str, float]:
    """Evaluate the greedy policy of a run in held-out environments, by the command.

    Args:
        run: Folder of the run.
        episodes: Held-out episodes.
        device: Device of the evaluation.

    Returns:
        The success rate, "share", and its exact 95% interval, "lower95" and "upper95".
    """
    call(
        "evaluate",
        "seed=0",
        f"checkpoint={run}",
        f"episodes={episodes}",
        "baselines=false",
        "videos=0",
        f"device={device}",
        f"hydra.run.dir={run}/evaluation",
    )
    evaluation = json.loads((run / "evaluation" / "evaluation.json").read_text())
    return evaluation["greedy"]["success"]


_BRIEF = ("trainer.total_frames=4000", "trainer.confirm_episodes=0")


def bench_flight_training(
    experiment: str, folder: Path, seeds: Sequence[int], episodes: int, device: str, quick: bool
) -> dict[str, Any]:
    """Train an experiment with vehicle dynamics from each seed and evaluate the greedy policies.

    Args:
        experiment: Name of the experiment, and prefix of the figures' keys.
        folder: Folder of the runs.
        seeds: Seeds of the trainings.
        episodes: Held-out episodes of each policy.
        device: Device of training and evaluation.
        quick: Whether to train only one seed, briefly.

    Returns:
        For each seed "..._time_to_solve_s", seconds until the command ends, "..._frames", and
        "..._success_lower95", the lower bound of the exact 95% interval of the success rate;
        "..._solved", the number of seeds that reached the target.
    """
    tried = seeds[:1] if quick else seeds
    settings = [f"experiment={experiment}", *(_BRIEF if quick else ())]
    done = train_and_evaluate(folder, tried, settings, 50 if quick else episodes, device)
    return {
        f"{experiment}_time_to_solve_s": done["seconds"],
        f"{experiment}_frames": done["frames"],
        f"{experiment}_success_lower95": done["lower95"],
        f"{experiment}_solved": done["reason"].count("solved"),
    }
