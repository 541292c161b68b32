"""The rules of cube collection, written once for one world and for thousands.

Pure functions of tensors whose first dimension counts worlds. They know nothing of how the drone
came to where it is: `judge` is handed its new state by any dynamics (chapter, Algorithms 1 to 3).

World frame, metres: x forward, y left, z up.
"""

import dataclasses
import enum
from collections.abc import Sequence

import numpy as np
import torch
from torch import Tensor

from drone_rl.config import TaskSettings
from drone_rl.sim.dynamics.body import BodyState
from drone_rl.utils.batch import Batch


class Side(enum.IntEnum):
    """Where a cube stood, seen from the drone, when it became the next cube."""

    LEFT = 0
    AHEAD = 1
    RIGHT = 2


class EndReason(enum.IntEnum):
    """Why an episode ended."""

    RUNNING = 0
    ALL_CUBES = 1
    FRONT_BOUNDARY = 2
    SIDE_BOUNDARY = 3
    STEP_LIMIT = 4
    LOST_CONTROL = 5
    """Its motion diverged, see `BodyState.is_lost`: counts most of all reasons."""


@dataclasses.dataclass
class WorldState(Batch):
    """The whole state of `num_worlds` worlds; `C` is the number of cubes."""

    body: BodyState
    """The drone's."""
    cubes: Tensor  # (num_worlds, C, 3) float64
    """Positions at which the cubes were placed, metres, in the order of their x."""
    collected: Tensor  # (num_worlds, C) bool
    """Cubes that the drone has touched."""
    passed: Tensor  # (num_worlds, C) bool
    """Cubes that the drone has left behind untouched."""
    side: Tensor  # (num_worlds, C) int64
    """`Side` of each cube when it became the next one; -1 before that."""
    lateral: Tensor  # (num_worlds, C) float64
    """Metres to the left of the drone at which it stood then; NaN before that."""
    steps: Tensor  # (num_worlds,) int64
    """Steps taken in this episode."""
    end_reason: Tensor  # (num_worlds,) int64
    """`EndReason` of each world."""

    @property
    def drone(self) -> Tensor:
        """Position of the drone, metres. Shape: (num_worlds, 3)."""
        return self.body.position

    @property
    def present(self) -> Tensor:
        """Cubes that still stand. Shape: (num_worlds, C)."""
        return ~(self.collected | self.passed)

    @property
    def next_cube(self) -> Tensor:
        """Index of the nearest standing cube, C when none is left. Shape: (num_worlds,)."""
        return (~self.present).long().cumprod(-1).sum(-1)


def draw_cubes(settings: TaskSettings, random_state: np.random.RandomState) -> Tensor:
    """Draws the places of an episode's cubes (Algorithm 2).

    Returns:
        Positions, metres. Shape: (num_cubes, 3).
    """
    n, y, z = settings.num_cubes, settings.lateral_bound, settings.vertical_bound
    offsets = random_state.uniform(-1.0, 1.0, size=(n, 2)) * (y, z) + (0.0, settings.altitude)
    x = settings.first_distance + settings.spacing * np.arange(n)
    return torch.from_numpy(np.column_stack([x, offsets]))


def origin(settings: TaskSettings) -> tuple[float, float, float]:
    """Where the drone starts, metres."""
    return (0.0, 0.0, settings.altitude)


def start(
    settings: TaskSettings, cubes: Sequence[Tensor] | Tensor, body: BodyState | None = None
) -> WorldState:
    """The state at the start of an episode.

    Args:
        settings: The task's.
        cubes: Positions of the cubes, metres. Shape: (num_worlds, num_cubes, 3).
        body: The drone's; at rest at its origin by default.
    """
    cubes = torch.stack(list(cubes)) if not isinstance(cubes, Tensor) else cubes
    if body is None:
        body = BodyState.at_rest(cubes.new_tensor(origin(settings)).repeat(len(cubes), 1))
    no_cube = torch.zeros_like(cubes[..., 0], dtype=torch.bool)
    state = WorldState(
        body=body,
        cubes=cubes,
        collected=no_cube,
        passed=no_cube.clone(),
        side=no_cube.long() - 1,
        lateral=torch.full_like(cubes[..., 1], torch.nan),
        steps=no_cube[:, 0].long(),
        end_reason=no_cube[:, 0].long(),
    )
    state.side, state.lateral = _sightings(settings, state)
    return state


def judge(settings: TaskSettings, state: WorldState, body: BodyState) -> tuple[WorldState, Tensor]:
    """Applies Algorithms 1 and 3 after the drone has moved.

    A touched cube is collected and worth 1; a cube left behind vanishes; the episode ends when all
    cubes are collected, when the drone is out of bounds, or at the step limit, in this order; a
    drone whose motion has diverged ends it before all these.

    Args:
        settings: The task's.
        state: Before the move.
        body: The drone after the move.

    Returns:
        The new state and the reward. Reward shape: (num_worlds,), float64.
    """
    drone = body.position
    away = (drone[:, None] - state.cubes).abs().amax(-1)  # (num_worlds, C)
    touched = state.present & (away <= settings.touch_distance)
    collected = state.collected | touched
    passed = state.passed | (~collected & (drone[:, None, 0] > state.cubes[..., 0]))
    new = dataclasses.replace(
        state, body=body, collected=collected, passed=passed, steps=state.steps + 1
    )
    new.side, new.lateral = _sightings(settings, new)
    new.end_reason = _end_reason(settings, new)
    return new, touched.sum(-1, dtype=torch.float64)


def side_of(settings: TaskSettings, lateral: Tensor) -> Tensor:
    """`Side` of a cube that stands so many metres to the left. Shape kept."""
    right = torch.where(lateral < -settings.touch_distance, Side.RIGHT.value, Side.AHEAD.value)
    return torch.where(lateral > settings.touch_distance, Side.LEFT.value, right)


def _sightings(settings: TaskSettings, state: WorldState) -> tuple[Tensor, Tensor]:
    """Side and lateral offset, now recorded of every cube up to the next one. Shapes: (N, C)."""
    offset = state.cubes[..., 1] - state.drone[:, None, 1]
    side = side_of(settings, offset)
    index = torch.arange(state.side.shape[-1], device=side.device)
    is_new = (state.side < 0) & (index <= state.next_cube[:, None])
    return torch.where(is_new, side, state.side), torch.where(is_new, offset, state.lateral)


def _end_reason(settings: TaskSettings, state: WorldState) -> Tensor:
    """The first reason that holds, in the order of Algorithm 3. Shape: (num_worlds,)."""
    x, y, _ = state.drone.unbind(-1)
    reason = (
        torch.zeros_like(state.steps)
        .masked_fill(state.steps >= settings.step_limit, EndReason.STEP_LIMIT)
        .masked_fill(y.abs() > settings.side_bound, EndReason.SIDE_BOUNDARY)
        .masked_fill(x > settings.front_bound, EndReason.FRONT_BOUNDARY)
        .masked_fill(state.collected.all(-1), EndReason.ALL_CUBES)
    )
    if type(state.body) is BodyState:  # whose motion can't diverge
        return reason
    return reason.masked_fill(state.body.is_lost, EndReason.LOST_CONTROL)
