"""What kind of policy a run ended with."""

from typing import Any

KINDS = ("good", "one-sided", "poor", "none")
"""Verdicts, best first; "none" is a policy in between."""


def classify(summary: dict[str, Any], num_cubes: int) -> str:
    """One of `KINDS`, from an evaluation's figures with their exact intervals.

    Args:
        summary: As `drone_rl.evaluation.summarise` returns it.
        num_cubes: Cubes of an episode.
    """
    if summary["all_cubes"]["lower95"] >= 0.9:
        return "good"
    left, right = summary["by_side"]["left"], summary["by_side"]["right"]
    if any(a["upper95"] < 0.3 and b["lower95"] > 0.6 for a, b in ((left, right), (right, left))):
        return "one-sided"
    return "poor" if summary["mean_cubes"] < 0.4 * num_cubes else "none"
