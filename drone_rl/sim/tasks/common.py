"""Parts that several tasks use: sides, contacts, classes of goals, views."""

import enum
import math
from collections.abc import Iterator, Sequence

import torch
from torch import Tensor

from drone_rl.config import CameraSettings
from drone_rl.sim.actions import Move
from drone_rl.sim.tasks.task import Goals
from drone_rl.utils.text import ordinal

HIDDEN_DEPTH = 100.0
"""Metres below its place at which an absent prop is kept, out of sight under the floor."""

FAR_BELOW = 10_000.0
"""Metres below the ground at which the scene files of other episodes are kept."""


class Side(enum.IntEnum):
    """Where something is, seen from the drone: strata of tasks that count by side."""

    LEFT = 0
    AHEAD = 1
    RIGHT = 2


SIDES = tuple(side.name.lower() for side in Side)


def side_of(lateral: Tensor, tolerance: float) -> Tensor:
    """Return the `Side` of metres to the left; AHEAD within `tolerance` metres. Shape kept."""
    right = torch.where(lateral < -tolerance, Side.RIGHT.value, Side.AHEAD.value)
    return torch.where(lateral > tolerance, Side.LEFT.value, right)


def turn_towards(lateral: Tensor, tolerance: float) -> Tensor:
    """Return the move towards metres to the left; FORWARD within `tolerance`. Shape kept."""
    moves = torch.tensor([Move.LEFT, Move.FORWARD, Move.RIGHT], device=lateral.device)
    return moves[side_of(lateral, tolerance)]


def first_contact(reach: float | Tensor, before: Tensor, now: Tensor, places: Tensor) -> Tensor:
    """Return where drones that fly straight from `before` to `now`, (N, D), touch `places`.

    A drone touches a place, (N, P, D), if it is at most `reach` metres away along every axis, the
    same for all axes or one for each. Its path enters all slabs of that box before it leaves any.

    Returns:
        Fraction of the path before the first contact; inf without contact. Shape: (N, P).
    """
    away, path = places - before[:, None], (now - before)[:, None]
    is_still = path == 0
    pace = torch.where(is_still, 1.0, path)
    ends = torch.stack([(away - reach) / pace, (away + reach) / pace])
    low, high = ends.amin(0), ends.amax(0)
    inside = away.abs() <= reach
    low = torch.where(is_still, torch.where(inside, 0.0, torch.inf), low)
    high = torch.where(is_still, torch.where(inside, 1.0, -torch.inf), high)
    enters = low.amax(-1).clamp(min=0.0)
    return torch.where(enters <= high.amin(-1).clamp(max=1.0), enters, torch.inf)


def number_classes(name: str, goals: Goals) -> Iterator[tuple[str, str, Tensor]]:
    """Yield one class for each goal of an episode: first, second, and so on."""
    for number in range(goals.reached.shape[-1]):
        mask = torch.zeros_like(goals.reached)
        mask[:, number] = True
        yield name, ordinal(number), mask


def interval_classes(
    name: str, values: Tensor, edges: Sequence[float]
) -> Iterator[tuple[str, str, Tensor]]:
    """Yield the classes of goals whose values, in metres, lie between two edges or above all."""
    for low, high in zip(edges, [*edges[1:], torch.inf], strict=True):
        label = f"{low:g} to {high:g} m" if high < torch.inf else f"more than {low:g} m"
        yield name, label, (values > low) & (values <= high)


def place_in_view(
    draw: Tensor, camera: CameraSettings, nearest: float, farthest: float, widest: float
) -> Tensor:
    """Return random positions in view of a camera, uniform over the image's columns.

    `draw` are numbers in [0, 1) for distance and column. Positions are metres ahead of the camera
    and to its left, from `nearest` to `farthest` ahead and at most `widest` aside; a column that is
    wider even at `nearest` is used there. Shapes: (*, 2).
    """
    slope = (2 * draw[..., 1] - 1) * math.tan(math.radians(camera.horizontal_fov / 2))
    most = (widest / slope.abs().clamp_min(1e-9)).clamp(max=farthest).clamp(min=nearest)
    ahead = nearest + draw[..., 0] * (most - nearest)
    return torch.stack([ahead, slope * ahead], -1)
