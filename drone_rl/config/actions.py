"""What can be chosen about what a policy can ask for."""

import dataclasses
from typing import Annotated

from drone_rl.utils.schema import OneOf, Real
from drone_rl.utils.settings import Settings

ACTION_KINDS = ("moves", "velocity")
Speed = Annotated[float, Real(0.0, 50.0, is_above=True, unit="m/s")]


@dataclasses.dataclass(frozen=True, kw_only=True)
class ActionSettings(Settings):
    """The actions between which a policy chooses, one at each control step.

    Raises:
        InputError: A value is out of range.
    """

    kind: Annotated[str, OneOf(ACTION_KINDS)] = "moves"
    """moves, the chapter's three of equal length without turning, or velocity: forward speed, speed
    to the left and yaw rate, any of these at once."""
    move_speed: Speed = 4.0
    """At which a move in flight shifts the place where the drone is wanted, in metres a second; in
    computer-vision mode a move is the task's step."""
    move_lead: Annotated[float, Real(0.01, 100.0, unit="m")] = 0.5
    """How far ahead of the drone that place may be, in metres."""
    forward_speed: Speed = 4.0
    """The greatest speed forward that can be asked for, in metres a second; none is backward."""
    sideways_speed: Speed = 3.0
    """The greatest speed to either side, in metres a second."""
    yaw_rate: Annotated[float, Real(0.0, 720.0, unit="degrees/s")] = 45.0
    """The greatest rate of turning to either side, in degrees a second; 0 for none."""

    @property
    def is_first(self) -> bool:
        """Whether these are the actions of files that name none."""
        return self == MOVES_SETTINGS


MOVES_SETTINGS = ActionSettings()
"""The chapter's three moves."""
