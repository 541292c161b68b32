"""States of drones, at rest or in flight, and the obstacles around them."""

import dataclasses
from typing import NamedTuple, Self

import torch
from torch import Tensor

from drone_rl.utils.batch import Batch

LEVEL = (1.0, 0.0, 0.0, 0.0)
"""The attitude of a drone that is level and looks forward, quaternion (w, x, y, z)."""


def heading_only(attitude: Tensor) -> Tensor:
    """Attitudes without their tilt: the turns about the world's z axis that are nearest to them.

    Args:
        attitude: Unit quaternions (w, x, y, z). Shape: (*, 4).

    Returns:
        The same shape; level and looking forward for a drone upside down, which has no heading.
    """
    w, z = attitude[..., 0], attitude[..., 3]
    length = (w * w + z * z).sqrt()
    zero, has_one = torch.zeros_like(length), length > 0.0
    w, z = torch.where(has_one, w / length, 1.0), torch.where(has_one, z / length, 0.0)
    return torch.stack([w, zero, zero, z], -1)


def heading_of(attitude: Tensor) -> Tensor:
    """Where drones look, radians to the left of the world's x.

    Args:
        attitude: Unit quaternions (w, x, y, z). Shape: (*, 4).
    """
    w, x, y, z = attitude.unbind(-1)
    return torch.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


@dataclasses.dataclass
class BodyState(Batch):
    """The bodies of `num_worlds` drones. World frame (x forward, y left, z up), SI units."""

    position: Tensor  # (num_worlds, 3) float64
    """Metres."""
    attitude: Tensor  # (num_worlds, 4) float64
    """Unit quaternion (w, x, y, z) that turns the body's frame into the world's."""
    velocity: Tensor  # (num_worlds, 3) float64
    """Metres a second."""
    angular_velocity: Tensor  # (num_worlds, 3) float64
    """Radians a second; of drones in flight about the body's axes."""

    @property
    def is_lost(self) -> Tensor:
        """Whether a drone's motion has diverged, so that there is nothing more to say of it.

        Shape: (num_worlds,), bool.
        """
        return torch.zeros(len(self.position), dtype=torch.bool, device=self.position.device)

    def moved(self, position: Tensor, attitude: Tensor | None = None) -> Self:
        """The same elsewhere.

        Args:
            position: Metres. Shape: (num_worlds, 3), float64.
            attitude: As it is by default. Shape: (num_worlds, 4), float64.
        """
        attitude = self.attitude if attitude is None else attitude
        return dataclasses.replace(self, position=position, attitude=attitude)

    @classmethod
    def at_rest(cls, position: Tensor, attitude: Tensor | None = None) -> Self:
        """Bodies that don't move.

        Args:
            position: Metres. Shape: (num_worlds, 3), float64.
            attitude: Level by default. Shape: (num_worlds, 4), float64.
        """
        if attitude is None:
            attitude = position.new_tensor(LEVEL).repeat(len(position), 1)
        still = torch.zeros_like(position)
        return cls(position, attitude, still, still.clone())


@dataclasses.dataclass(frozen=True)
class Obstacles:
    """Boxes along the world's axes, in every world as many and all of one size. Metres."""

    centers: Tensor  # (num_worlds, K, 3) float64
    """Their middles; far below the ground where one is absent."""
    half_sizes: tuple[float, float, float]
    """Half their edges."""


NOTHING, GROUND = -2, -1
"""Numbers of what is touched: no thing, and the ground. Obstacles count from 0."""


class Slot(NamedTuple):
    """Where a part of `FlightState.numbers` stands."""

    first: int
    last: int
    """The one after the last."""


POSITION = Slot(0, 3)
ATTITUDE = Slot(3, 7)
VELOCITY = Slot(7, 10)
RATES = Slot(10, 13)
ROTORS = Slot(13, 17)
REFERENCE = Slot(17, 21)
CLIMB = Slot(21, 22)
GUST = Slot(22, 25)
SEED = Slot(25, 26)
TICKS = Slot(26, 27)
LOST = Slot(27, 28)
THING = Slot(28, 29)
NORMAL = Slot(29, 32)
POINT = Slot(32, 35)
DEPTH = Slot(35, 36)
TIME = Slot(36, 37)
NUMBERS = TIME.last
"""Of a drone."""


@dataclasses.dataclass
class Contact(Batch):
    """What `num_worlds` drones last touched. World frame, SI units."""

    thing: Tensor  # (num_worlds,) int64
    """An obstacle's number, `GROUND`, or `NOTHING` where nothing was touched in this episode."""
    normal: Tensor  # (num_worlds, 3) float64
    """Unit vector out of the thing."""
    point: Tensor  # (num_worlds, 3) float64
    """Where, metres."""
    depth: Tensor  # (num_worlds,) float64
    """How far the ball around the drone reached into the thing, metres."""
    time: Tensor  # (num_worlds,) float64
    """When, seconds of the episode."""


class FlightState(BodyState):
    """`num_worlds` drones in flight: a row of numbers each, of which the properties are views."""

    def __init__(self, numbers: Tensor) -> None:
        """Takes all of them at once; kernels read and write them in one piece.

        Args:
            numbers: In the order of the slots. Shape: (num_worlds, NUMBERS), float64.
        """
        self.numbers = numbers

    @classmethod
    def at_rest(
        cls, position: Tensor, attitude: Tensor | None = None, seeds: Tensor | None = None
    ) -> Self:
        """Drones that don't move, told to stay where they are.

        Args:
            position: Metres. Shape: (num_worlds, 3), float64.
            attitude: Level by default. Shape: (num_worlds, 4), float64.
            seeds: Of their gusts, whole numbers. Shape: (num_worlds,).
        """
        state = cls(position.new_zeros(len(position), NUMBERS))
        state.position[:] = position
        state.attitude[:] = position.new_tensor(LEVEL) if attitude is None else attitude
        state.numbers[:, THING.first] = NOTHING
        if seeds is not None:
            state.numbers[:, SEED.first] = seeds.to(state.numbers)
        return state.settled()

    def settled(self) -> Self:
        """The same, told to stay where they are."""
        state = type(self)(self.numbers.clone())
        state.reference[:, :2] = self.position[:, :2]
        state.reference[:, 2] = self.heading
        state.reference[:, 3] = self.position[:, 2]
        return state

    def moved(self, position: Tensor, attitude: Tensor | None = None) -> Self:
        """See `BodyState`; they are told to stay there."""
        state = type(self)(self.numbers.clone())
        state.position[:] = position
        if attitude is not None:
            state.attitude[:] = attitude
        return state.settled()

    @property
    def position(self) -> Tensor:  # pyright: ignore[reportIncompatibleVariableOverride] (a view)
        """Metres. Shape: (num_worlds, 3)."""
        return self._part(POSITION)

    @property
    def attitude(self) -> Tensor:  # pyright: ignore[reportIncompatibleVariableOverride] (a view)
        """Unit quaternion (w, x, y, z). Shape: (num_worlds, 4)."""
        return self._part(ATTITUDE)

    @property
    def velocity(self) -> Tensor:  # pyright: ignore[reportIncompatibleVariableOverride] (a view)
        """Metres a second, world frame. Shape: (num_worlds, 3)."""
        return self._part(VELOCITY)

    @property
    def angular_velocity(self) -> Tensor:  # pyright: ignore[reportIncompatibleVariableOverride]
        """Radians a second about the body's axes. Shape: (num_worlds, 3)."""
        return self._part(RATES)

    @property
    def heading(self) -> Tensor:
        """To the left of the world's x, radians. Shape: (num_worlds,)."""
        return heading_of(self.attitude)

    @property
    def rotors(self) -> Tensor:
        """Share of its most thrust that each gives: front right, rear left, front left, rear right.

        Shape: (num_worlds, 4).
        """
        return self._part(ROTORS)

    @property
    def reference(self) -> Tensor:
        """Where the controller wants the drone: metres, world frame; and its heading, radians.

        The order is x, y, heading, z, as in `goals`. Shape: (num_worlds, 4).
        """
        return self._part(REFERENCE)

    @property
    def gust(self) -> Tensor:
        """Velocity of the air beside its mean, metres a second, world. Shape: (num_worlds, 3)."""
        return self._part(GUST)

    @property
    def ticks(self) -> Tensor:
        """Of physics in this episode, int64. Shape: (num_worlds,)."""
        return self.numbers[:, TICKS.first].long()

    @property
    def contact(self) -> Contact:
        """The last one."""
        one = [self.numbers[:, slot.first] for slot in (THING, DEPTH, TIME)]
        return Contact(one[0].long(), self._part(NORMAL), self._part(POINT), one[1], one[2])

    @property
    def is_lost(self) -> Tensor:
        """See `BodyState`; a lost drone stays where it was last seen."""
        return self.numbers[:, LOST.first] != 0.0

    def _part(self, slot: Slot) -> Tensor:
        return self.numbers[:, slot.first : slot.last]
