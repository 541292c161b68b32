"""What policies reach in the indoor scene, with and without the image, by moves and in flight."""

import statistics
from typing import Any

from benchmarks.benchmark import Setup
from benchmarks.seeing import train_both

SCENE = "indoor"
SUCCESS = 0.9
"""Success rate of a verdict that counts as solved."""
WALKING = (
    *("experiment=reach", "inputs=[gray,goal,last_action]", "inputs.goal.scale=5"),
    *("inputs.gray.size=[12,24]", "inputs.gray.horizontal_fov=110"),
)
FLYING = (
    *("experiment=reach_flight", "inputs=[depth,goal,velocity]", "inputs.goal.scale=5"),
    *("inputs.depth.size=[12,24]", "inputs.depth.horizontal_fov=110", "inputs.depth.maximum=6"),
    "inputs.velocity.scale=2",
)
PLACES = "task.start.site=anywhere", "task.objects.goal.site=kitchen"
"""Starts in all free space and a goal around corners: 19% of them have a free straight path to it.
To the scene's `goal`, 54% of its starts have one, which needs no image."""
_MOST = {"moves": 3_000_000, "flight": 6_000_000}
"""Frames after which a training ends at the latest."""
_WAYS = {"moves": (*PLACES, *WALKING), "flight": (*PLACES, *FLYING)}


def task_in(scene: str) -> tuple[str, ...]:
    """Return the settings of the task in a scene."""
    return "task=reach", f"task.scene={scene}"


def bench_world_training(setup: Setup) -> dict[str, Any]:
    """Train `reach` in the indoor scene from three seeds, by moves that turn and in flight.

    Returns:
        "world_solve_s", the median of the seconds until a training ends whose verdict's success is
        at least 0.9 (None if one is less); "world_lower95", the least lower end of the success
        rates of the verdicts; "world_blind", the largest success rate of policies that learned from
        as many frames without the image; "world_success", that of each seed; "world_frames". All of
        them are by "moves" and "flight".
    """
    found = {name: _compare(setup, name) for name in _WAYS}
    keys = next(iter(found.values()))
    return {key: {name: figures[key] for name, figures in found.items()} for key in keys}


def _compare(setup: Setup, way: str) -> dict[str, Any]:
    folder, settings = setup.runs / "worlds" / way, (*task_in(SCENE), *_WAYS[way])
    made = train_both(setup, folder, _MOST[way], settings, _without_image(settings))
    is_solved = min(one["share"] for one in made.seeing) >= SUCCESS
    return {
        "world_solve_s": statistics.median(made.seconds) if is_solved else None,
        "world_lower95": min(one["lower95"] for one in made.seeing),
        "world_blind": max(one["share"] for one in made.blind),
        "world_success": [one["share"] for one in made.seeing],
        "world_frames": made.frames,
    }


def _without_image(settings: tuple[str, ...]) -> tuple[str, ...]:
    """Return settings without those of the image, the first input."""
    kept = (one for one in settings if not one.startswith(("inputs.gray.", "inputs.depth.")))
    return tuple(one.replace("[gray,", "[").replace("[depth,", "[") for one in kept)
