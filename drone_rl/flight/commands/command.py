"""A command: what drones are told, a control period at a time, until it is done."""

import abc
import math

import torch
from torch import Tensor

from drone_rl.sim.dynamics import FlightState, Goals, Mode
from drone_rl.sim.dynamics.control import Modes

PERIOD = 0.02
"""Seconds from one decision of a command to the next, at least."""
ACCURACY = 0.5
"""Metres within which a place counts as reached."""
HOLD = (Mode.POSITION, Mode.POSITION, Mode.ANGLE, Mode.POSITION)
"""Modes of a drone that stays where it is told."""


class Command(abc.ABC):
    """All drones of a batch are told the same, or the same with other numbers. It is used once."""

    limit: float = math.inf
    """Seconds after which it is over, done or not."""
    lasts: bool = False
    """Whether to have run for so long is what it is for."""

    def begin(self, body: FlightState) -> None:
        """Notes where the drones are when they are told."""
        del body

    @abc.abstractmethod
    def goals(self, body: FlightState) -> Goals:
        """What the drones are told until the next period."""

    def is_complete(self, body: FlightState) -> Tensor:
        """Which drones have done what they were told. Shape: (num_worlds,), bool."""
        return torch.zeros(len(body), dtype=torch.bool)

    def rest(self, body: FlightState) -> Tensor | None:
        """Where drones that are done stay; None where no place was asked for.

        Shape: (num_worlds, 4), as in `FlightState.reference`.
        """
        del body
        return None


def column(body: FlightState, value: float | Tensor) -> Tensor:
    """A number for every drone. Shape: (num_worlds,)."""
    return torch.as_tensor(value, dtype=torch.float64).expand(len(body))


def goals_of(
    body: FlightState,
    modes: Modes,
    x: float | Tensor,
    y: float | Tensor,
    heading: float | Tensor,
    z: float | Tensor,
) -> Goals:
    """Goals out of numbers for all drones or tensors with one for each. Shapes: (num_worlds,)."""
    return Goals(modes, torch.stack([column(body, v) for v in (x, y, heading, z)], -1))


def hold(reference: Tensor) -> Goals:
    """To stay. Shape: (num_worlds, 4), as in `FlightState.reference`."""
    return Goals(HOLD, reference)
