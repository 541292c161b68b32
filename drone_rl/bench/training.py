"""Whole trainings, as a user starts them: time to solve and success."""

import json
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from drone_rl.bench.commands import call


def bench_solve(
    folder: Path, seeds: Sequence[int], episodes: int, device: str, quick: bool
) -> dict[str, Any]:
    """Trains with the defaults from each seed and evaluates each policy, greedy.

    Returns:
        Per seed: seconds from the start of the command to its end, whether it reached the target
        and the lower end of the exact 95% interval of the share of complete episodes.
    """
    results: dict[str, list] = {"time_to_solve_s": [], "frames_to_solve": [], "success_lower95": []}
    reasons = []
    settings = ["experiment=smoke"] if quick else []
    for seed in seeds[:1] if quick else seeds:
        run = folder / f"train_{seed}"
        begin = time.perf_counter()
        call("train", f"seed={seed}", f"device={device}", f"hydra.run.dir={run}", *settings)
        results["time_to_solve_s"].append(time.perf_counter() - begin)
        result = json.loads((run / "result.json").read_text())
        results["frames_to_solve"].append(result["frames"])
        reasons.append(result["reason"])
        call(
            "evaluate",
            f"checkpoint={run}",
            f"episodes={50 if quick else episodes}",
            "baselines=false",
            "videos=0",
            f"device={device}",
            f"hydra.run.dir={run}/evaluation",
        )
        evaluation = json.loads((run / "evaluation" / "evaluation.json").read_text())
        results["success_lower95"].append(evaluation["greedy"]["success"]["lower95"])
    return {
        **results,
        "median_time_to_solve_s": float(np.median(results["time_to_solve_s"])),
        "seeds_solved": reasons.count("solved"),
        "seeds_tried": len(reasons),
    }
