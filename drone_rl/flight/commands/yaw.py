"""Heading control during a movement: drivetrain and yaw mode (Table 3)."""

import dataclasses
import enum
import math

import torch
from torch import Tensor

from drone_rl.flight.commands.checks import real
from drone_rl.sim.dynamics import Mode
from drone_rl.utils.errors import InputError


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
        limit = 3600.0
        number = real(self.yaw_or_rate, "yaw_or_rate", -limit, limit, unit="degrees")
        object.__setattr__(self, "yaw_or_rate", number)

    @property
    def radians(self) -> float:
        """The number in radians (per second)."""
        return math.radians(self.yaw_or_rate)


def parse_drivetrain(given: str) -> Drivetrain:
    """Return a drivetrain by name.

    Raises:
        InputError: The name is unknown.
    """
    try:
        return Drivetrain(given)
    except ValueError as error:
        known = ", ".join(Drivetrain)
        raise InputError(f"drivetrain={given!r} is unknown; give one of: {known}") from error


class YawControl:
    """Computes the heading goal, the third of four, in each control period."""

    def __init__(
        self, drivetrain: str = Drivetrain.MAX_DEGREE_OF_FREEDOM, yaw_mode: YawMode | None = None
    ) -> None:
        """Create a heading control.

        Args:
            drivetrain: One of `Drivetrain`.
            yaw_mode: By default the drone faces its direction of travel with
                `Drivetrain.FORWARD_ONLY`, and else holds its heading.

        Raises:
            InputError: A rate is combined with `Drivetrain.FORWARD_ONLY`, or a value is unknown.
        """
        self.is_forward = parse_drivetrain(drivetrain) == Drivetrain.FORWARD_ONLY
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
        self._heading: Tensor | None = None

    @property
    def mode(self) -> Mode:
        """Goal mode of the heading."""
        return Mode.RATE if self._is_rate else Mode.ANGLE

    @property
    def _is_rate(self) -> bool:
        return self.yaw_mode.is_rate and self.yaw_mode.yaw_or_rate != 0.0

    def begin(self, heading: Tensor) -> None:
        """Start from the current headings, radians. Shape: (num_worlds,)."""
        self._heading = heading.clone()

    def goal(self, travel: Tensor, least: float) -> Tensor:
        """Return the heading goals.

        Args:
            travel: Direction of travel (displacement or velocity), world frame.
                Shape: (num_worlds, 3).
            least: Horizontal length of `travel` up to which the previous goal is kept.

        Returns:
            Radians (per second). Shape: (num_worlds,).
        """
        wanted = self.yaw_mode.radians
        assert self._heading is not None, "call begin first"
        if not self.is_forward:
            holds = self.yaw_mode.is_rate and not self._is_rate
            return self._heading if holds else torch.full_like(travel[:, 0], wanted)
        x, y, _ = travel.unbind(-1)
        along = torch.atan2(y, x) + wanted
        self._heading = torch.where(torch.hypot(x, y) > least, along, self._heading)
        return self._heading
