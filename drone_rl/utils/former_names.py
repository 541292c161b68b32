"""Figures that older checkpoints, policies, results and metrics call by another name."""

from collections.abc import Mapping
from typing import Any

FORMER_NAMES = {
    "running_cubes": "running_reward",
    "train/running_cubes": "train/running_reward",
    "train/cubes": "train/reward",
    "num_cubes": "largest_reward",
}
"""The name in an older file, and the present one."""


def with_present_names(figures: Mapping[str, Any]) -> dict[str, Any]:
    """Figures out of a file of any age, by the names that they have now."""
    return {FORMER_NAMES.get(name, name): value for name, value in figures.items()}
