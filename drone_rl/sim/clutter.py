"""Where distractors stand: beside the way, as far ahead as what matters."""

from typing import Any

import numpy as np
import torch
from torch import Tensor

from drone_rl.config import AppearanceSettings
from drone_rl.config.task import BaseTaskSettings, Things

HIDDEN_DEPTH = 100.0
"""Metres under the ground at which those are kept that are not there."""
PALETTE = (
    (0.93, 0.71, 0.22),
    (0.20, 0.55, 0.62),
    (0.87, 0.87, 0.83),
    (0.36, 0.62, 0.36),
    (0.29, 0.40, 0.66),
    (0.58, 0.47, 0.66),
)
"""Yellow, teal, white, green, blue, violet: none is red, as cubes are, or brown, as pillars are."""
WIDTH = 7
"""Numbers of each: its place, its size, its colour."""
_TURN = (5**0.5 - 1) / 2
"""Of all shares of a way by which things go on, the one that leaves the most even gaps."""


def things_of(task: Any) -> Things | None:
    """Where the things of a task stand, or of its settings; none where that can't be said."""
    settings = task if isinstance(task, BaseTaskSettings) else getattr(task, "settings", None)
    return getattr(settings, "things", None)


def most_distractors(settings: AppearanceSettings) -> int:
    """How many there are at most."""
    count = settings.distractors
    return count[1] if isinstance(count, tuple) else count


def stand(
    things: Things, ahead: Tensor, aside: Tensor, is_left: Tensor, height: float | Tensor
) -> Tensor:
    """Places beside the way.

    Args:
        things: Whose way.
        ahead: Metres. Shape: (*).
        aside: Metres between them and where things may stand. Shape: (*).
        is_left: On which side. Shape: (*).
        height: Metres.

    Returns:
        Metres, world frame. Shape: (*, 3), float64.
    """
    side = (things.bound + aside) * (2.0 * is_left.double() - 1.0)
    return torch.stack([ahead, side, torch.as_tensor(height).expand(ahead.shape)], -1)


def draw_distractors(
    settings: AppearanceSettings, things: Things | None, source: np.random.RandomState | None
) -> list[float]:
    """One number after the other: `WIDTH` of each distractor that there may be.

    They stand on the ground, by turns to the left and to the right.

    Args:
        settings: What is drawn from.
        things: Where what matters stands.
        source: Middles of all ranges without.
    """
    most = most_distractors(settings)
    if not most or things is None:
        return []
    number = torch.arange(most)
    count = _drawn(settings.distractors, source, ())
    if isinstance(settings.distractors, tuple) and source is not None:
        count = source.randint(settings.distractors[0], most + 1)
    begin, shift = _drawn((0.0, 1.0), source, ()), _drawn((-0.5, 0.5), source, (most,))
    share = (begin + number // 2 * _TURN + number % 2 * 0.5 + shift / most) % 1.0
    size = _drawn(settings.distractor_size, source, (most,))
    away = _drawn(settings.distractor_distance, source, (most,)) + size / 2
    height = size / 2 - HIDDEN_DEPTH * (number >= count)
    ahead = share * (things.first + things.last)
    places = stand(things, ahead, away, number % 2 == 0, height)
    colors = torch.stack([_color(settings, source, i) for i in range(most)])
    return torch.cat([places, size[:, None], colors], -1).flatten().tolist()


def _drawn(value: Any, source: np.random.RandomState | None, shape: tuple[int, ...]) -> Tensor:
    low, high = value if isinstance(value, tuple) else (value, value)
    if low == high or source is None:
        return torch.full(shape, (low + high) / 2, dtype=torch.float64)
    return torch.as_tensor(source.uniform(low, high, shape), dtype=torch.float64)


def _color(
    settings: AppearanceSettings, source: np.random.RandomState | None, number: int
) -> Tensor:
    given = settings.distractor_color
    if given is None:
        turn = number + number // len(PALETTE)  # or all of a kind had one colour
        return torch.tensor(PALETTE[turn % len(PALETTE)], dtype=torch.float64)
    ends = given if isinstance(given[0], tuple) else (given, given)
    return torch.stack([_drawn(pair, source, ()) for pair in zip(*ends, strict=True)])
