"""Whole trainings, as a user starts them: time to solve and success."""

import json
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from drone_rl.bench.commands import call, train


def bench_solve(
    folder: Path, seeds: Sequence[int], episodes: int, device: str, quick: bool
) -> dict[str, Any]:
    """Trains with the defaults from each seed and evaluates each policy, greedy.

    Returns:
        Per seed: seconds from the start of the command to its end, whether it reached the target
        and the lower end of the exact 95% interval of the share of complete episodes.
    """
    tried = seeds[:1] if quick else seeds
    settings = ["experiment=smoke"] if quick else []
    done = _train(folder, tried, settings, 50 if quick else episodes, device)
    return {
        "time_to_solve_s": done["seconds"],
        "frames_to_solve": done["frames"],
        "success_lower95": done["lower95"],
        "median_time_to_solve_s": float(np.median(done["seconds"])),
        "seeds_solved": done["reason"].count("solved"),
        "seeds_tried": len(tried),
    }


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
    done = _train(folder, tried, settings, 50 if quick else episodes, device)
    return {
        "pillars_train_s": done["seconds"],
        "pillars_frames": done["frames"],
        "pillars_lower95": done["lower95"],
        "pillars_solved": done["reason"].count("solved"),
    }


def _train(
    folder: Path, seeds: Sequence[int], settings: Iterable[str], episodes: int, device: str
) -> dict[str, list]:
    """Trains from each seed and evaluates, by the commands that a user gives."""
    results: dict[str, list] = {"seconds": [], "frames": [], "reason": [], "lower95": []}
    for seed in seeds:
        run = folder / f"train_{seed}"
        seconds, result = train(run, f"seed={seed}", f"device={device}", *settings)
        results["seconds"].append(seconds)
        results["frames"].append(result["frames"])
        results["reason"].append(result["reason"])
        call(
            "evaluate",
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
