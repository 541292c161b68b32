"""Changes of scenes that explanations make: targets that are removed, moved or placed.

A target is an object to which the drone flies, or else one that it avoids, known by its number.
Functions that take a state return a new one. Metres. Offsets are forward, to the left and up as
the drone is headed.
"""

import dataclasses
from typing import Any, NamedTuple

import torch
from torch import Tensor

from drone_rl.config import CameraSettings
from drone_rl.sim.actions import Move
from drone_rl.sim.dynamics import BodyState
from drone_rl.sim.dynamics.state import heading_of
from drone_rl.sim.tasks.common import Side, place_in_view, turn_towards
from drone_rl.sim.tasks.geometry_kernel import GOAL, NOTHING, OBSTACLE
from drone_rl.sim.tasks.objects import ObjectState, ObjectTask


class Grid(NamedTuple):
    """Positions at which targets can stand, metres from the drone, as three axes of float64."""

    height: Tensor  # (Z,)
    forward: Tensor  # (F,)
    lateral: Tensor  # (L,)


class Range(NamedTuple):
    """Where targets stand, seen from the drone. Metres."""

    nearest: float
    farthest: float
    widest: float
    """To either side."""


def turned(offset: Tensor, heading: Tensor) -> Tensor:
    """Return offsets, (*, 2) or (*, 3), turned to the left by headings, radians, (*,)."""
    cos, sin = heading.cos().to(offset), heading.sin().to(offset)
    x, y = offset[..., 0], offset[..., 1]
    flat = torch.stack([cos * x - sin * y, sin * x + cos * y], -1)
    return torch.cat([flat, offset[..., 2:]], -1)


@dataclasses.dataclass(frozen=True)
class SceneEdits:
    """Questions about a task's targets, and changes of them."""

    task: ObjectTask
    reach: float
    """Sideways distance up to which flying straight on touches a target, metres."""
    ahead: Range
    """Where the next target can be."""
    around: Range
    """Where random targets are placed."""
    heights: tuple[float, ...] = (0.0,)
    """Of targets above the drone's start."""
    is_sorted: bool = False
    """Whether the targets' numbers follow their order of x."""
    course: float | None = 0.0
    """Heading along which drones pass targets, radians; None if episodes have no common one."""

    @property
    def is_followed(self) -> bool:
        """Whether targets are goals; else they are obstacles."""
        return bool((self.task.roles == GOAL).any())

    @property
    def _targets(self) -> Tensor:
        return self.task.roles == (int(GOAL) if self.is_followed else int(OBSTACLE))

    def next_target(self, state: ObjectState) -> Tensor:
        """Return the target that calls for action now; their number if none does. (N,)."""
        ahead = state.ahead.long()
        return torch.where(ahead == NOTHING, len(self.task.each), ahead)

    def next_offset(self, state: ObjectState) -> Tensor:
        """Return the next target's offset from the drone; NaN if there is none. (N, 3).

        That of an obstacle is horizontal.
        """
        target, places = self.next_target(state), self.task.places(state)
        last, env = places.shape[1] - 1, torch.arange(len(state), device=places.device)
        away = places[env, target.clamp(max=last)] - state.body.position
        if not self.is_followed:
            away = away * torch.tensor([1.0, 1.0, 0.0]).to(away)
        away = turned(away, -heading_of(state.body.attitude))
        return torch.where((target <= last)[:, None], away, torch.nan)

    def is_reached(self, state: ObjectState, target: Tensor) -> Tensor:
        """Return whether a goal is touched, or an obstacle passed without a touch. (N,)."""
        if self.is_followed:
            last = state.touched.shape[1] - 1
            rows = torch.arange(len(state), device=target.device)
            return state.touched[rows, target.clamp(max=last)]
        return self.is_behind(state, target) & ~state.touched.any(-1)

    def is_behind(self, state: ObjectState, target: Tensor) -> Tensor:
        """Return whether the drone has passed a target, or its place. Shape of both: (N,)."""
        if self.course is None:
            return torch.zeros_like(target, dtype=torch.bool)
        env = torch.arange(len(state), device=target.device)
        away = self.task.places(state)[env, target] - state.body.position
        return turned(away, torch.full_like(away[:, 0], -self.course))[:, 0] < 0.0

    def needed(self, offset: Tensor) -> Tensor:
        """Return the move for a target at an offset from the drone. (N, 3) to (N,).

        It is one to the side of a goal that flying straight on would miss, and away from an
        obstacle that it would touch.
        """
        lateral = offset[..., 1]
        if self.is_followed:
            return turn_towards(lateral, self.reach)
        turn = torch.where(lateral > 0, Move.RIGHT, Move.LEFT)
        return torch.where(lateral.abs() <= self.reach, turn, Move.FORWARD)

    def stratum_at(self, offset: Tensor) -> Tensor:
        """Return the side on which a target at an offset calls for a turn. (N, 3) to (N,)."""
        sides = torch.tensor([Side.AHEAD, Side.LEFT, Side.RIGHT], device=offset.device)
        return sides[self.needed(offset)]

    def grid(self, num_forward: int, num_lateral: int) -> Grid:
        """Return where next targets can stand, seen from the drone; symmetric sideways."""
        at = self.ahead
        forward = torch.linspace(at.nearest, at.farthest, num_forward).double()
        lateral = torch.linspace(at.widest, -at.widest, num_lateral).double()
        return Grid(torch.tensor(self.heights, dtype=torch.float64), forward, lateral)

    def one_target(self, body: BodyState, offset: Tensor) -> ObjectState:
        """Return states with a single target, at that offset from each drone. Shape: (N, 3).

        An obstacle stands on the ground.
        """
        first = int(self._targets.nonzero()[0, 0])
        places = body.position[:, None].repeat(1, len(self.task.each), 1).double()
        places[:, first] += turned(offset.to(places), heading_of(body.attitude))
        if not self.is_followed:
            places[..., 2] = self.task.each[first].half_size[2]
        state = self.task.begun(body, places)
        present = torch.zeros_like(state.present)
        present[:, first] = True
        return self._changed(state, present=present)

    def without_next(self, state: ObjectState) -> ObjectState:
        """Remove the next target, if there is one."""
        return self._changed(state, present=state.present & ~self._is_next(state))

    def next_moved(self, state: ObjectState, metres: Tensor | float) -> ObjectState:
        """Move the next target to the drone's left. Shape of `metres`: (N,), or a number."""
        left = torch.zeros_like(state.body.position)
        left[:, 1] = metres
        shift = turned(left, heading_of(state.body.attitude))[:, None]
        places = state.places + shift * self._is_next(state)[..., None]
        return self._changed(state, places=places)

    def elsewhere(
        self, state: ObjectState, camera: CameraSettings, generator: torch.Generator
    ) -> ObjectState:
        """Move all targets to random positions in view of the camera."""
        draw = torch.rand(*state.places.shape, generator=generator, dtype=torch.float64)
        at, is_target = self.around, self._targets.to(state.places.device)
        away = place_in_view(draw[..., :2], camera, at.nearest, at.farthest, at.widest)
        places = state.places.clone()
        away = turned(away.to(places), heading_of(state.body.attitude)[:, None])
        random = state.drone[:, None, :2] + away
        places[..., :2] = torch.where(is_target[:, None], random, places[..., :2])
        if self.is_sorted:
            up = (2 * draw[..., 2] - 1) * max(self.heights)
            places[..., 2] = state.drone[:, None, 2] + up.to(places)
            order = places[..., :1].argsort(1).expand_as(places)
            places = places.gather(1, order)
        changes: dict[str, Any] = {"places": places, "present": state.present | is_target}
        if self.is_followed:
            changes |= {name: getattr(state, name) & ~is_target for name in ("touched", "reached")}
        return self._changed(state, **changes)

    def _is_next(self, state: ObjectState) -> Tensor:
        number = torch.arange(len(self.task.each), device=state.places.device)
        return number == self.next_target(state)[:, None]

    def _changed(self, state: ObjectState, **changes: Tensor) -> ObjectState:
        copies = {name: getattr(state, name).clone() for name in ("ahead", "sides", "noted")}
        new = dataclasses.replace(state, **copies, **changes)
        self.task.look_ahead(new)
        return new
