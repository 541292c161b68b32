"""Time of exact maps, and correctness of the closed-form images that they use."""

import statistics
from contextlib import closing
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drone_rl.policies.policy import load_policy
from drone_rl.utils.progress import silent
from drone_rl.verification.places import places
from drone_rl.verification.prover.cube_images import CubeImages
from drone_rl.verification.prover.policy_spec import make_policy_spec

_BATCH = 2000


def bench_places(quick: bool) -> dict[str, Any]:
    """Measure maps of the shipped policies and compare closed-form images with rendered ones.

    Args:
        quick: Whether to compute one map and compare few images.

    Returns:
        "places_s": median seconds of a map, with loading; "places_cells": cells of a map in the
        default window; "places_wrong": images that differ from the renderer's, out of
        "places_compared", those of "places_drawn" images that are not on a border of cells.
    """
    names = ("good",) if quick else ("good", "poor", "right_and_forward")
    maps = [places(name, progress=silent).numbers for name in names]
    count, random_state = (400 if quick else 100_000), np.random.RandomState(1)
    wrong = compared = 0
    for cubes in (2, 3):
        policy = load_policy("good").in_task(num_cubes=cubes)
        policy_spec = make_policy_spec(policy.description, policy.make_network(), 0.0)
        with closing(policy_spec) as spec:
            for begin in range(0, count // 2, _BATCH):
                size = min(_BATCH, count // 2 - begin)
                found = compare(
                    spec.images, spec.lattice.task.front_bound, cubes, size, random_state
                )
                wrong, compared = wrong + found[0], compared + found[1]
    return {
        "places_s": statistics.median(one["seconds"] for one in maps),
        "places_cells": maps[0]["cells"],
        "places_wrong": wrong,
        "places_compared": compared,
        "places_drawn": count // 2 * 2,
    }


def compare(
    images: CubeImages,
    farthest: float,
    num_cubes: int,
    count: int,
    random_state: np.random.RandomState,
) -> tuple[int, int]:
    """Compare rendered and closed-form images at random positions.

    Args:
        images: Images of a task with moves of 1 m.
        farthest: Largest x of the drone, metres.
        num_cubes: Number of cubes of the task.
        count: Number of images.
        random_state: Random state of the positions of drone and cubes.

    Returns:
        The number of different images that are not on a border, and the number of images that are
        not on a border.
    """
    cubes = random_state.uniform(-8.0, 8.0, (count, num_cubes))
    where: NDArray[Any] = random_state.uniform([0.0, -8.0], [farthest, 8.0], (count, 2))
    rendered, (computed, is_clear) = images.render(cubes, where), images.closed_form(cubes, where)
    differs = (rendered != computed).flatten(1).any(-1).numpy()
    return int((differs & is_clear).sum()), int(is_clear.sum())
