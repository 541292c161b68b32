"""AirSim's numbers of things in pictures, and the colour that stands for each."""

import functools
import random

import torch
from torch import Tensor

from drone_rl.sim.rendering import Scene
from drone_rl.utils.errors import InputError

NUM_IDS = 256
"""Numbers that there are, from 0, which is that of the sky."""
_SEED = 42
"""Of the draw that AirSim's colours came out of."""


@functools.cache
def palette() -> Tensor:
    """AirSim's colours. Shape: (256, 3), uint8: red, green, blue of each number.

    Each channel, from blue to red, has the 256 values in an order drawn by chance; then number 0 is
    black and 255 white.
    """
    draw = random.Random(_SEED)
    colors = torch.zeros(NUM_IDS, 3, dtype=torch.uint8)
    for channel in (2, 1, 0):
        left = list(range(256))
        for number in range(NUM_IDS):
            colors[number, channel] = left.pop(draw.randrange(len(left)))
    colors[0], colors[-1] = 0, 255
    return colors


def object_names(scene: Scene) -> list[str]:
    """What AirSim's functions may call each geom of a scene: "ground", "target_0", "obstacle_2".

    Geoms of one thing share its name, as do those that belong to none and mean the same.
    """
    pairs = zip(scene.semantic_classes, scene.props, strict=True)
    return [
        meaning.name.lower() if prop < 0 else f"{meaning.name.lower()}_{prop}"
        for meaning, prop in pairs
    ]


def default_id(name: str) -> int:
    """The number that AirSim gives a thing by its name alone.

    Things whose names differ in digits only have the same.
    """
    return (5 + sum(ord(letter) for letter in name.lower() if letter >= "a")) % NUM_IDS


def default_ids(scene: Scene) -> Tensor:
    """The same of each geom of a scene. Shape: (num_geoms,), int64."""
    return torch.tensor([default_id(name) for name in object_names(scene)])


def check_ids(ids: Tensor, num_geoms: int) -> Tensor:
    """Numbers of geoms, as they may be given.

    Args:
        ids: Shape: (num_geoms,), whole numbers.
        num_geoms: How many geoms there are.

    Raises:
        InputError: There are more or fewer, or one is no number from 0 to 255.
    """
    if ids.shape != (num_geoms,):
        raise InputError(
            f"ids of shape {tuple(ids.shape)} don't fit {num_geoms} geoms; give one for each"
        )
    for number in ids.tolist():
        if number not in range(NUM_IDS):
            raise InputError(f"id {number} is out of range; give whole numbers from 0 to 255")
    return ids.long()
