"""What policies reach in the indoor scene, with and without the image, by moves and in flight."""

import statistics
import time
from pathlib import Path
from typing import Any

from benchmarks.benchmark import Setup
from benchmarks.commands import call
from drone_rl.trust.rule import VerdictKind
from drone_rl.utils.exit_codes import NOT_CERTAIN
from drone_rl.utils.files import read_json
from drone_rl.utils.run_result import RunResult

SCENE = "indoor"
SUCCESS = 0.9
"""Success rate of a verdict that counts as solved."""
STATUSES = (NOT_CERTAIN, *(kind.exit_code for kind in VerdictKind))
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
    folder, settings = setup.runs / "worlds" / way, _WAYS[way]
    most = 20_000 if setup.quick else _MOST[way]
    seconds, frames, seeing, blind = [], [], [], []
    for seed in setup.seeds[:3]:
        run = folder / f"seeing_{seed}"
        begin = time.perf_counter()
        train(run, seed, most, *settings)
        seconds.append(time.perf_counter() - begin)
        frames.append(RunResult.read_json(run / "result.json").frames)
        seeing.append(success(run, setup.quick))
        run = folder / f"blind_{seed}"
        train(run, seed, frames[-1], *_without_image(settings), "trainer.target_share=null")
        blind.append(success(run, setup.quick))
    is_solved = min(one["share"] for one in seeing) >= SUCCESS
    return {
        "world_solve_s": statistics.median(seconds) if is_solved else None,
        "world_lower95": min(one["lower95"] for one in seeing),
        "world_blind": max(one["share"] for one in blind),
        "world_success": [one["share"] for one in seeing],
        "world_frames": frames,
    }


def _without_image(settings: tuple[str, ...]) -> tuple[str, ...]:
    """Return settings without those of the image, the first input."""
    kept = (one for one in settings if not one.startswith(("inputs.gray.", "inputs.depth.")))
    return tuple(one.replace("[gray,", "[").replace("[depth,", "[") for one in kept)


def train(run: Path, seed: int, most: int, *settings: str) -> None:
    """Train in the indoor scene for at most so many frames."""
    last = ("logger=csv", f"seed={seed}", f"trainer.total_frames={most}", f"hydra.run.dir={run}")
    call("train", *task_in(SCENE), *settings, *last)


def success(run: Path, quick: bool) -> dict[str, Any]:
    """Return the success rate of a verdict, with its interval."""
    made, few = run / "verdict", ["episodes=100"] if quick else []
    call("verdict", f"policy={run}", f"hydra.run.dir={made}", *few, statuses=STATUSES)
    return read_json(made / "verdict.json")["greedy"]["success"]
