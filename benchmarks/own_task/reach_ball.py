"""Reach a ball among boxes."""

import warp as wp

from drone_rl import Step, define_task, reward


@reward("near_box", weight=-0.2)
def near_box(step: Step, distance: float = 0.6) -> float:
    """1 within `distance` metres of anything solid."""
    return wp.where(step.clearance < distance, 1.0, 0.0)


define_task(
    "reach_ball",
    start={"z": 1.2},
    objects={
        "ball": {
            "shape": "ball",
            "role": "goal",
            "size": [5.0, 5.0, 5.0],
            "color": [1.0, 1.0, 1.0],
            "x": [9.0, 12.0],
            "y": [-4.0, 4.0],
            "z": 3.0,
        },
        "boxes": {"count": 3, "size": [0.8, 0.8, 1.6], "x": [4.0, 9.0], "apart": 1.5},
    },
    reward={"progress": 0.1, "reached": 1.0, "contact": -1.0, "near_box": -0.2},
    end=["contact", "out_of_bounds"],
    success=["all_goals"],
    step_limit=40,
)
