"""Policies that are trained until they are proved."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from benchmarks.commands import train


def bench_provable(folder: Path, seeds: Sequence[int], quick: bool) -> dict[str, Any]:
    """Trains from each seed until the policy is proved, as a user starts it.

    Args:
        folder: For the runs.
        seeds: Of the trainings.
        quick: Whether one cube and one seed will do.

    Returns:
        Per seed: seconds from the start of the command to its end, searches for failures, and
        whether it is proved.
    """
    results: dict[str, list] = {"provable_s": [], "provable_rounds": [], "provable_proved": []}
    easier = ["task=collect_one", "provable.flights=500"] if quick else []
    for seed in seeds[:1] if quick else seeds:
        run = folder / f"provable_{seed}"
        seconds, result = train(run, "experiment=provable", f"seed={seed}", *easier)
        results["provable_s"].append(seconds)
        results["provable_rounds"].append(len(result["rounds"]))
        results["provable_proved"].append(result["reason"] == "proved")
    return results
