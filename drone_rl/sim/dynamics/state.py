"""States of drones, at rest or in flight, and the obstacles around them."""

import dataclasses
from typing import Any, Self

import torch
from torch import Tensor

from drone_rl.sim.scenes.solids import PlacedSolids
from drone_rl.utils.batch import Batch

LEVEL = (1.0, 0.0, 0.0, 0.0)
"""The attitude of a drone that is level and looks forward, quaternion (w, x, y, z)."""


def twist_about_z(attitude: Tensor) -> Tensor:
    """Return the twist about z of quaternions (w, x, y, z), (*, 4); upside down becomes `LEVEL`."""
    w, z = attitude[..., 0], attitude[..., 3]
    length = (w * w + z * z).sqrt()
    zero, has_one = torch.zeros_like(length), length > 0.0
    w, z = torch.where(has_one, w / length, 1.0), torch.where(has_one, z / length, 0.0)
    return torch.stack([w, zero, zero, z], -1)


def heading_of(attitude: Tensor) -> Tensor:
    """Return headings, radians to the left of the world's x. Unit quaternions: (*, 4)."""
    w, x, y, z = attitude.unbind(-1)
    return torch.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


@dataclasses.dataclass
class BodyState(Batch):
    """The bodies of `num_envs` drones. World frame (x forward, y left, z up), SI units."""

    position: Tensor  # (num_envs, 3) float64
    attitude: Tensor  # (num_envs, 4) float64
    """Unit quaternion (w, x, y, z) that rotates vectors from the body frame to the world frame."""
    velocity: Tensor  # (num_envs, 3) float64
    angular_velocity: Tensor  # (num_envs, 3) float64
    """Radians per second, body frame; `Kinematic` drones turn about z alone."""

    @property
    def is_lost(self) -> Tensor:
        """Whether each drone's motion has diverged. Shape: (num_envs,), bool."""
        return torch.zeros(len(self.position), dtype=torch.bool, device=self.position.device)

    def moved(self, position: Tensor, attitude: Tensor | None = None) -> Self:
        """Return the same at another position, (num_envs, 3), and attitude, (num_envs, 4)."""
        attitude = self.attitude if attitude is None else attitude
        return dataclasses.replace(self, position=position, attitude=attitude)

    @classmethod
    def at_rest(cls, position: Tensor, attitude: Tensor | None = None) -> Self:
        """Return bodies that don't move, level by default; shapes as of `moved`."""
        if attitude is None:
            attitude = position.new_tensor(LEVEL).repeat(len(position), 1)
        still = torch.zeros_like(position)
        return cls(position, attitude, still, still.clone())


@dataclasses.dataclass(frozen=True)
class Obstacles:
    """Axis-aligned boxes of one size, as many in every environment, or a scene. Metres."""

    centers: Tensor  # (num_envs, K, 3) float64
    """Their middles; far below the ground where one is absent."""
    half_sizes: tuple[float, float, float]
    scene: PlacedSolids | None = None
    """What is solid in scene files, which replaces the ground at height 0."""


NOTHING, GROUND = -2, -1
"""Numbers of what is touched: no thing, and the ground. Obstacles count from 0, then solids."""


POSITION, ATTITUDE, VELOCITY, RATES, ROTORS, REFERENCE = 0, 3, 7, 10, 13, 17
CLIMB_INTEGRAL, GUST, SEED, TICKS, LOST, THING = 21, 22, 25, 26, 27, 28
NORMAL, POINT, DEPTH, TIME = 29, 32, 35, 36
"""First column of each quantity in `FlightState.numbers`."""
NUMBERS = 37


@dataclasses.dataclass
class Contact(Batch):
    """What `num_envs` drones last touched. World frame, SI units."""

    thing: Tensor  # (num_envs,) int64
    """Number of an obstacle or solid, `GROUND`, or `NOTHING` until something is touched."""
    normal: Tensor  # (num_envs, 3) float64
    """Unit vector out of the thing."""
    point: Tensor  # (num_envs, 3) float64
    depth: Tensor  # (num_envs,) float64
    """How far the ball around the drone reached into the thing, metres."""
    time: Tensor  # (num_envs,) float64
    """When, seconds of the episode."""


def _columns(first: int, count: int) -> Any:
    """Return a read-only property: some columns of `FlightState.numbers`, as a view."""
    columns = slice(first, first + count)
    return property(lambda state: state.numbers[:, columns])


class FlightState(BodyState):
    """`num_envs` drones in flight: a row of numbers each, of which the attributes are views."""

    position = _columns(POSITION, 3)
    attitude = _columns(ATTITUDE, 4)
    velocity = _columns(VELOCITY, 3)
    angular_velocity = _columns(RATES, 3)
    rotors: Tensor = _columns(ROTORS, 4)
    """Fractions of full thrust: front right, rear left, front left, rear right. (N, 4)."""
    reference: Tensor = _columns(REFERENCE, 4)
    """Target of the controller: x, y, heading, z; metres and radians. Shape: (N, 4)."""
    gust: Tensor = _columns(GUST, 3)
    """Velocity of the air minus its mean, metres a second, world. Shape: (num_envs, 3)."""

    def __init__(self, numbers: Tensor) -> None:
        """Take all numbers, see `POSITION` and following. Shape: (num_envs, NUMBERS), float64."""
        self.numbers = numbers

    def __len__(self) -> int:
        """See `Batch`; asked for in every control period, so without a search for the entries."""
        return self.numbers.shape[0]

    @classmethod
    def at_rest(
        cls, position: Tensor, attitude: Tensor | None = None, seeds: Tensor | None = None
    ) -> Self:
        """See `BodyState`; they hold their position. `seeds` are those of gusts, (num_envs,)."""
        state = cls(position.new_zeros(len(position), NUMBERS))
        state.position[:] = position
        state.attitude[:] = position.new_tensor(LEVEL) if attitude is None else attitude
        state.numbers[:, THING] = NOTHING
        if seeds is not None:
            state.numbers[:, SEED] = seeds.to(state.numbers)
        return state.settled()

    def settled(self) -> Self:
        """Return the same with its pose as the reference."""
        state = type(self)(self.numbers.clone())
        state.reference[:, :2] = self.position[:, :2]
        state.reference[:, 2] = self.heading
        state.reference[:, 3] = self.position[:, 2]
        return state

    def moved(self, position: Tensor, attitude: Tensor | None = None) -> Self:
        """See `BodyState`; the new pose is the reference."""
        state = type(self)(self.numbers.clone())
        state.position[:] = position
        if attitude is not None:
            state.attitude[:] = attitude
        return state.settled()

    @property
    def heading(self) -> Tensor:
        """To the left of the world's x, radians. Shape: (num_envs,)."""
        return heading_of(self.attitude)

    @property
    def ticks(self) -> Tensor:
        """Of physics in this episode, int64. Shape: (num_envs,)."""
        return self.numbers[:, TICKS].long()

    @property
    def contact(self) -> Contact:
        """The last one."""
        n = self.numbers
        normal, point = n[:, NORMAL : NORMAL + 3], n[:, POINT : POINT + 3]
        return Contact(n[:, THING].long(), normal, point, n[:, DEPTH], n[:, TIME])

    @property
    def is_lost(self) -> Tensor:
        """See `BodyState`; a lost drone keeps its last position."""
        return self.numbers[:, LOST] != 0.0
