"""Heading control during a movement: drivetrain and yaw mode (Table 3)."""

import dataclasses
import enum
import math

import torch
from torch import Tensor

from drone_rl.flight.commands.checks import real
from drone_rl.flight.commands.command import ACCURACY
from drone_rl.sim.dynamics import FlightState, Mode
from drone_rl.utils.errors import InputError
from drone_rl.utils.schema import OneOf


class Drivetrain(enum.StrEnum):
    """Whether a drone turns into its direction of travel (Table 3)."""

    FORWARD_ONLY = "forward_only"
    """The drone faces its direction of travel."""
    MAX_DEGREE_OF_FREEDOM = "max_degree_of_freedom"
    """The heading follows the yaw mode, whatever the direction of travel."""


@dataclasses.dataclass(frozen=True)
class YawMode:
    """Heading or yaw rate during a movement (Table 3). Positive is to the left.

    Raises:
        InputError: The number is not finite.
    """

    is_rate: bool = True
    """Whether the number is a rate, else an angle. A rate of 0 holds the heading."""
    yaw_or_rate: float = 0.0
    """Degrees per second; or degrees, from the world's x axis, or from the direction of travel with
    `Drivetrain.FORWARD_ONLY`."""

    def __post_init__(self) -> None:
        """Check the number."""
        number = real(self.yaw_or_rate, "yaw_or_rate", -3600.0, 3600.0, unit="degrees")
        object.__setattr__(self, "yaw_or_rate", number)


class YawControl:
    """Computes the heading goal, the third of four, in each control period."""

    def __init__(
        self,
        body: FlightState,
        drivetrain: str = Drivetrain.MAX_DEGREE_OF_FREEDOM,
        yaw_mode: YawMode | None = None,
    ) -> None:
        """Create a heading control.

        Args:
            body: State at the start.
            drivetrain: One of `Drivetrain`.
            yaw_mode: By default the drone faces its direction of travel with
                `Drivetrain.FORWARD_ONLY`, and else holds its heading.

        Raises:
            InputError: A rate is combined with `Drivetrain.FORWARD_ONLY`, or a value is unknown.
        """
        drivetrain = OneOf(tuple(Drivetrain)).read(drivetrain, "drivetrain")
        self.is_forward = drivetrain == Drivetrain.FORWARD_ONLY
        self.yaw_mode = yaw_mode or YawMode(is_rate=not self.is_forward)
        if not isinstance(self.yaw_mode, YawMode):
            raise InputError(
                f"yaw_mode={yaw_mode!r} is not a YawMode; give YawMode(is_rate, yaw_or_rate)"
            )
        if self.is_forward and self.yaw_mode.is_rate:
            raise InputError(
                f"yaw_mode={self.yaw_mode} turns at a rate, but drivetrain=forward_only faces the "
                "direction of travel; give is_rate=False, or max_degree_of_freedom"
            )
        is_rate = self.yaw_mode.is_rate and self.yaw_mode.yaw_or_rate != 0.0
        self.mode = Mode.RATE if is_rate else Mode.ANGLE
        """Goal mode of the heading."""
        self._heading = body.heading.clone()

    def goal(self, travel: Tensor) -> Tensor:
        """Return the heading goals.

        Args:
            travel: Direction of travel (displacement or velocity), world frame; the previous goal
                is kept up to a horizontal length of `ACCURACY`. Shape: (num_worlds, 3).

        Returns:
            Radians (per second). Shape: (num_worlds,).
        """
        wanted = math.radians(self.yaw_mode.yaw_or_rate)
        if not self.is_forward:
            holds = self.yaw_mode.is_rate and self.mode is Mode.ANGLE
            return self._heading if holds else torch.full_like(travel[:, 0], wanted)
        x, y, _ = travel.unbind(-1)
        along = torch.atan2(y, x) + wanted
        self._heading = torch.where(torch.hypot(x, y) > ACCURACY, along, self._heading)
        return self._heading
