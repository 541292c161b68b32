"""What a flying drone is: a body with rotors, a controller's memory, air, and contacts."""

import dataclasses
from typing import NamedTuple, Self

from torch import Tensor

from drone_rl.sim.dynamics.body import LEVEL, BodyState, heading_of
from drone_rl.utils.batch import Batch

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
