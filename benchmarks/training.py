"""Whole trainings, as a user starts them: time to solve and success."""

import json
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.commands import call, train


def bench_solve(
    folder: Path, seeds: Sequence[int], episodes: int, device: str, quick: bool
) -> dict[str, Any]:
    """Trains with the defaults from each seed and evaluates each policy, greedy.

    Returns:
        Per seed: seconds from the start of the command to its end, whether it reached the target
        and the lower end of the exact 95% interval of the share of complete episodes. And
        "learning_fps", the median of frames a second of collecting and learning together.
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
    """Trains with the defaults from 20 seeds that no setting was chosen by, and evaluates each.

    Returns:
        How many reach the target, and of each the seconds from the start of the command to its
        end, the frames, and the lower end of the share of 1,000 episodes with everything done.
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
    """Trains `experiment=large` for a while.

    Returns:
        Frames a second of collecting and learning together, kernels loaded.
    """
    frames = 500 if quick else 20_000
    limits = (f"trainer.total_frames={frames}", "trainer.target_share=null")
    train(folder / "large_first", "experiment=large", f"device={device}", *limits)
    _, result = train(folder / "large", "experiment=large", f"device={device}", *limits)
    return {"learning_fps_large": result["frames"] / result["seconds"]}


def bench_pillars(
    folder: Path, seeds: Sequence[int], episodes: int, device: str, quick: bool
) -> dict[str, Any]:
    """Trains `experiment=pillars` from each seed and evaluates each policy, greedy.

    Returns:
        Per seed: "pillars_train_s", seconds from the start of the command to its end;
        "pillars_lower95" of the share of held-out episodes that cross the line and touch no
        pillar; "pillars_frames".
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
    """Trains from each seed and evaluates, by the commands that a user gives.

    Args:
        folder: For the runs.
        seeds: Of the trainings.
        settings: Of each.
        episodes: Held-out flights of each policy.
        device: Where to train.

    Returns:
        Per seed: "seconds" of the command, "frames", "trained_s", "reason" and "lower95".
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
        results["lower95"].append(evaluation["greedy"]["success"]["lower95"])
    return results


_BRIEF = ("trainer.total_frames=4000", "trainer.confirm_episodes=0")


def bench_flight_training(
    experiment: str, folder: Path, seeds: Sequence[int], episodes: int, device: str, quick: bool
) -> dict[str, Any]:
    """Trains an experiment from each seed and evaluates each policy, greedy.

    Args:
        experiment: Its name, which is also the first part of the figures'.
        folder: For the runs.
        seeds: Of the trainings.
        episodes: Held-out flights of each policy.
        device: Where to train.
        quick: Whether one seed, trained for a moment, will do.

    Returns:
        Per seed: "..._time_to_solve_s", seconds from the start of the command to its end,
        "..._frames", and "..._success_lower95", the lower end of the exact 95% interval of the
        share of flights in which everything was done; "..._solved", how many reached the target.
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
