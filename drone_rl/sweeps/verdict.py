"""What kind of policy a run ended with, by the rule of `drone-rl verdict`."""

from typing import Any

from drone_rl.explain.verdict import Kind, judge_policy

KINDS = ("good", "one-sided", "poor", "none of these")
"""Verdicts, best first; to which side a policy keeps doesn't matter here."""


def classify(summary: dict[str, Any], num_cubes: int) -> str:
    """One of `KINDS`, from an evaluation's figures.

    Args:
        summary: As `drone_rl.evaluation.summarise` returns it.
        num_cubes: Cubes of an episode.
    """
    kind = judge_policy(summary, num_cubes).kind
    one_sided = kind in (Kind.ONE_SIDED_LEFT, Kind.ONE_SIDED_RIGHT)
    return "one-sided" if one_sided else kind.value
