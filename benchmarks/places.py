"""How long the exact map takes, and whether the closed form that it rests on is the renderer's."""

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
    """Times maps of the shipped policies, and compares pictures at random places.

    Args:
        quick: Whether to map once and compare few.

    Returns:
        "places_s": median seconds of a map, from the policy's file on; "places_cells": in the
        default window; "places_wrong": pictures that are not the renderer's, of
        "places_compared", those of "places_drawn" that lie on no border.
    """
    names = ("good",) if quick else ("good", "poor", "right_and_forward")
    maps = [places(name, progress=silent).numbers for name in names]
    count, random_state = (400 if quick else 100_000), np.random.RandomState(1)
    wrong = compared = 0
    for cubes in (2, 3):
        policy = load_policy("good").in_task(num_cubes=cubes)
        made = make_policy_spec(policy.description, policy.make_network(), 0.0)
        with closing(made) as spec:
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
    """Draws and works out pictures from places that are on no lattice.

    Args:
        images: Of a task with moves of a metre.
        farthest: x that the drone gets to at most, metres.
        num_cubes: Of the task.
        count: How many pictures.
        random_state: Draws drones' and cubes' places.

    Returns:
        How many differ though they are on no border, and how many are on none.
    """
    cubes = random_state.uniform(-8.0, 8.0, (count, num_cubes))
    where: NDArray[Any] = random_state.uniform([0.0, -8.0], [farthest, 8.0], (count, 2))
    drawn, (made, is_clear) = images.render(cubes, where), images.closed_form(cubes, where)
    differs = (drawn != made).flatten(1).any(-1).numpy()
    return int((differs & is_clear).sum()), int(is_clear.sum())
