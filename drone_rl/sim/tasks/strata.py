"""Strata of a task of terms: bearing and distance of its goals at the start of an episode."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import torch
from torch import Tensor

from drone_rl.config.term_task import TermTaskSettings
from drone_rl.sim.tasks.common import Side, side_of
from drone_rl.sim.tasks.scene_edits import turned

START_AXES = ("x", "y", "z", "heading")
PHRASES = {"left": "on its left", "ahead": "ahead", "right": "on its right"}
_SAMPLES = 1000
_LEAST_DEGREES = 5.0
_LEAST_RATIO = 1.2
_ORDER = (
    *(("left", "far"), ("left", "near"), ("ahead", "near")),
    *(("ahead", "far"), ("right", "near"), ("right", "far")),
)


class Strata:
    """Classes of goals, from left to right, whose bounds leave about as many goals to each."""

    degrees: float
    """Largest bearing to either side that is ahead: of a third of all goals, at least 5."""
    metres: float
    """Largest distance that is near: that of half of all goals; infinite if they hardly differ."""
    phrases: dict[str, str]
    """What follows "goals" in a sentence, by the name of each stratum."""

    def __init__(self, start: Tensor, places: Tensor) -> None:
        """Choose bounds for examples of starts and goals; see `seen_from_start`."""
        bearing, distance = seen_from_start(start, places)
        self.degrees = max(_LEAST_DEGREES, float(bearing.abs().quantile(1 / 3).round()))
        low, middle, high = distance.quantile(torch.tensor([0.1, 0.5, 0.9]).double()).tolist()
        self.metres = float(f"{middle:.2g}") if high > _LEAST_RATIO * low else math.inf
        away = {"near": f"up to {self.metres:g} m away", "far": f"over {self.metres:g} m away"}
        parts = {f"{side}_{part}": f"{PHRASES[side]} {away[part]}" for side, part in _ORDER}
        self.phrases = parts if self.metres < math.inf else PHRASES

    def of(self, start: Tensor, places: Tensor) -> Tensor:
        """Return the number of each goal's stratum, (n, G) int64; see `seen_from_start`."""
        bearing, distance = seen_from_start(start, places)
        side = side_of(bearing, self.degrees)
        if self.metres == math.inf:
            return side
        is_far = distance > self.metres
        return 2 * side + torch.where(side == Side.LEFT, ~is_far, is_far).long()


def drawn(settings: TermTaskSettings) -> tuple[Tensor, Tensor]:
    """Return examples of the starts and goals that settings allow; see `seen_from_start`."""
    source = np.random.RandomState(0)

    def draw(of: Any, axes: Sequence[str]) -> Tensor:
        values = [source.uniform(*of.range_of(axis), size=_SAMPLES) for axis in axes]
        return torch.from_numpy(np.stack(values, -1))

    start = draw(settings.start, START_AXES)
    start[:, 3].deg2rad_()
    goals = [of for of in settings.objects.values() if of.role == "goal"]
    return start, torch.stack([draw(of, "xyz") for of in goals for _ in range(of.count)], 1)


def seen_from_start(start: Tensor, places: Tensor) -> tuple[Tensor, Tensor]:
    """Return bearings to the left, degrees, and distances, metres, of goals. Shapes: (n, G).

    Args:
        start: x, y, z (m) and heading (rad). Shape: (n, 4).
        places: Centres of the goals. Shape: (n, G, 3).
    """
    offset = turned(places - start[:, None, :3], -start[:, 3:])
    return torch.atan2(offset[..., 1], offset[..., 0]).rad2deg(), offset.norm(dim=-1)
