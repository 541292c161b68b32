"""A reward term for keeping away from obstacles."""

import warp as wp

from drone_rl import Step, reward


@reward("near_wall", weight=-0.1)
def near_wall(step: Step, distance: float = 0.5) -> float:
    """1 within `distance` metres of anything solid."""
    return wp.where(step.clearance < distance, 1.0, 0.0)
