"""Where a drone looks while it goes somewhere."""

import dataclasses
import enum
import math

import torch
from torch import Tensor

from drone_rl.flight.commands.checks import real
from drone_rl.sim.dynamics import Mode
from drone_rl.utils.errors import InputError


class Drivetrain(enum.StrEnum):
    """Whether a drone turns into the direction in which it goes (Table 3)."""

    FORWARD_ONLY = "forward_only"
    """It looks where it goes."""
    MAX_DEGREE_OF_FREEDOM = "max_degree_of_freedom"
    """It looks where its yaw mode says, and goes anywhere."""


@dataclasses.dataclass(frozen=True)
class YawMode:
    """How a drone is turned while it goes (Table 3). Positive is to the left.

    Raises:
        InputError: The number is none.
    """

    is_rate: bool = True
    """Whether the number is a rate; an angle otherwise. At a rate of 0 the heading is held."""
    yaw_or_rate: float = 0.0
    """Degrees a second; or degrees, from the world's x, or from the direction of travel where the
    drone goes forward only."""

    def __post_init__(self) -> None:
        """Refuses what is no number."""
        limit = 3600.0
        number = real(self.yaw_or_rate, "yaw_or_rate", -limit, limit, unit="degrees")
        object.__setattr__(self, "yaw_or_rate", number)

    @property
    def radians(self) -> float:
        """The number, in radians (a second)."""
        return math.radians(self.yaw_or_rate)


def read_drivetrain(given: str) -> Drivetrain:
    """One of them, by itself or by its name.

    Raises:
        InputError: There is none of that name.
    """
    try:
        return Drivetrain(given)
    except ValueError as error:
        known = ", ".join(Drivetrain)
        raise InputError(f"drivetrain={given!r} is unknown; give one of: {known}") from error


class Turning:
    """The third of four goals, period after period."""

    def __init__(
        self, drivetrain: str = Drivetrain.MAX_DEGREE_OF_FREEDOM, yaw_mode: YawMode | None = None
    ) -> None:
        """Takes what was chosen.

        Args:
            drivetrain: One of `Drivetrain`.
            yaw_mode: By default the drone looks where it goes if that is how it flies, and else
                isn't turned.

        Raises:
            InputError: A rate is given to a drone that goes forward only, or there is no such
                choice.
        """
        self.is_forward = read_drivetrain(drivetrain) == Drivetrain.FORWARD_ONLY
        self.yaw_mode = yaw_mode or YawMode(is_rate=not self.is_forward)
        if not isinstance(self.yaw_mode, YawMode):
            raise InputError(f"yaw_mode={yaw_mode!r} is none; give YawMode(is_rate, yaw_or_rate)")
        if self.is_forward and self.yaw_mode.is_rate:
            raise InputError(
                f"yaw_mode={self.yaw_mode} turns at a rate, but drivetrain=forward_only looks "
                "where it goes; give is_rate=False, or max_degree_of_freedom"
            )
        self._heading: Tensor | None = None

    @property
    def mode(self) -> Mode:
        """Of the goals for the heading."""
        return Mode.RATE if self._is_rate else Mode.ANGLE

    @property
    def _is_rate(self) -> bool:
        return self.yaw_mode.is_rate and self.yaw_mode.yaw_or_rate != 0.0

    def begin(self, heading: Tensor) -> None:
        """Starts from where drones look now, radians. Shape: (num_worlds,)."""
        self._heading = heading.clone()

    def goal(self, travel: Tensor, least: float) -> Tensor:
        """The goals for the heading.

        Args:
            travel: Where drones go to, as seen from them, or how fast; world frame.
                Shape: (num_worlds, 3).
            least: Its length below which it says nothing: then the goal stays.

        Returns:
            Radians (a second). Shape: (num_worlds,).
        """
        wanted = self.yaw_mode.radians
        assert self._heading is not None, "the command hasn't begun"
        if not self.is_forward:
            stays = self.yaw_mode.is_rate and not self._is_rate
            return self._heading if stays else torch.full_like(travel[:, 0], wanted)
        x, y, _ = travel.unbind(-1)
        along = torch.atan2(y, x) + wanted
        self._heading = torch.where(torch.hypot(x, y) > least, along, self._heading)
        return self._heading
