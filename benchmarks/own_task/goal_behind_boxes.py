"""Reach a ball behind boxes, which block most straight paths, from any heading."""

from drone_rl import define_task

define_task(
    "goal_behind_boxes",
    start={"x": [-10.0, -5.0], "y": [-6.0, 6.0], "z": 1.5, "heading": [-180.0, 180.0]},
    objects={
        "ball": {
            "shape": "ball",
            "role": "goal",
            "size": [1.5, 1.5, 1.5],
            "color": [1.0, 1.0, 1.0],
            "x": [5.0, 10.0],
            "y": [-6.0, 6.0],
            "z": 1.5,
        },
        "boxes": {
            "count": 6,
            "size": [1.7, 1.7, 4.0],
            "x": [-4.0, 4.0],
            "y": [-6.0, 6.0],
            "apart": 1.4,
        },
    },
    reward={"progress": 0.1, "reached": 1.0, "contact": -1.0, "time": -0.005},
    end=["contact", "out_of_bounds"],
    success=["all_goals"],
    margin=4.0,
    step_limit=100,
)
