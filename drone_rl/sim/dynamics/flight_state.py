"""What a flying drone is: a body with rotors, a controller's memory, air that moves, and contacts."""

import dataclasses

import torch
from torch import Tensor

from drone_rl.sim.batch import Batch
from drone_rl.sim.dynamics.body import BodyState

NOTHING, GROUND = -2, -1
"""Numbers of what is touched: no thing, and the ground. Obstacles count from 0."""


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

    @classmethod
    def none(cls, count: int) -> "Contact":
        """Nothing touched yet."""
        zeros = torch.zeros(count, 3, dtype=torch.float64)
        nothing = torch.full((count,), NOTHING, dtype=torch.int64)
        return cls(nothing, zeros, zeros.clone(), zeros[:, 0].clone(), zeros[:, 0].clone())


@dataclasses.dataclass
class FlightState(BodyState):
    """`num_worlds` drones in flight."""

    rotors: Tensor  # (num_worlds, 4) float64
    """Share of the most thrust that each rotor gives: front right, rear left, front left, rear
    right."""
    reference: Tensor  # (num_worlds, 4) float64
    """Where the controller wants it: metres, world frame; heading, radians."""
    climb_integral: Tensor  # (num_worlds,) float64
    """What the controller of the climb has summed up, share of half the thrust."""
    gust: Tensor  # (num_worlds, 3) float64
    """Velocity of the air beside its mean, metres a second, world frame."""
    seed: Tensor  # (num_worlds,) int64
    """Of the episode's gusts."""
    time: Tensor  # (num_worlds,) float64
    """Seconds of the episode."""
    contact: Contact
    """The last one."""
    lost: Tensor  # (num_worlds,) bool
    """Whether the motion has diverged; the drone then stays where it was last seen."""

    @property
    def is_lost(self) -> Tensor:
        """See `BodyState`."""
        return self.lost
