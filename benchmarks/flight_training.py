"""Whole trainings of drones that fly, as a user starts them: time to solve and success."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from benchmarks.training import train_and_evaluate

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
