"""Finished episodes of cube collection: their cubes, and the classes into which these fall."""

import dataclasses
from collections.abc import Iterator

import torch
from torch import Tensor

from drone_rl.config import TaskSettings
from drone_rl.sim.tasks.collect_cubes.rules import Side
from drone_rl.sim.tasks.judgeable import Goals
from drone_rl.utils.text import ordinal


@dataclasses.dataclass
class CubeGoals(Goals):
    """Cubes that were to be collected; their strata are sides."""

    lateral: Tensor  # (n, C) float64
    """Metres to the left of the drone at which each became the next one; NaN if it never did."""
    height: Tensor  # (n, C) float64
    """Metres by which each stands higher than the drone."""


def classes(settings: TaskSettings, cubes: CubeGoals) -> Iterator[tuple[str, str, Tensor]]:
    """By number of the cube, side, sideways distance and height; see `Judgeable.classes`."""
    for number in range(cubes.reached.shape[-1]):
        of = torch.zeros_like(cubes.reached)
        of[:, number] = True
        yield "cube", ordinal(number), of
    for side in Side:
        yield "side", side.name.lower(), cubes.stratum == side
    aside = cubes.lateral.abs()
    edges = sideways_edges(settings)
    for low, high in zip(edges, [*edges[1:], torch.inf], strict=True):
        label = f"{low:g} to {high:g} m" if high < torch.inf else f"more than {low:g} m"
        yield "sideways", label, (aside > low) & (aside <= high)
    if settings.vertical_bound > 0:
        level = settings.vertical_bound / 3
        yield "height", "lower", cubes.height < -level
        yield "height", "level", cubes.height.abs() <= level
        yield "height", "higher", cubes.height > level


def sideways_edges(settings: TaskSettings) -> list[float]:
    """Bounds of the classes of sideways distance, metres: from what is ahead, outwards."""
    touch, bound = settings.touch_distance, settings.lateral_bound
    edges = [round(2 * edge) / 2 for edge in ((touch + bound) / 2, bound, 1.5 * bound)]
    return [touch, *sorted({edge for edge in edges if edge > touch})]
