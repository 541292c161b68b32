"""Flying at a velocity, in the world's directions or in the drone's own."""

import enum

import torch

from drone_rl.flight.commands.command import ACCURACY, Command, goals_of
from drone_rl.flight.commands.turning import Turning
from drone_rl.sim.dynamics import FlightState, Goals, Mode
from drone_rl.sim.dynamics.control import Modes
from drone_rl.utils.errors import InputError


class Frame(enum.StrEnum):
    """In which directions a velocity is given."""

    WORLD = "world"
    """x forward from where the world began, y left."""
    BODY = "body"
    """x where the drone looks, y to its left; turns with the drone."""


def read_frame(given: str) -> Frame:
    """One of them, by itself or by its name.

    Raises:
        InputError: There is none of that name.
    """
    try:
        return Frame(given)
    except ValueError as error:
        raise InputError(f"frame={given!r} is unknown; give one of: {', '.join(Frame)}") from error


class ByVelocity(Command):
    """Keeps a velocity, climbing at a rate or at a height."""

    lasts = True

    def __init__(
        self,
        velocity: tuple[float, float],
        duration: float,
        *,
        climb: float = 0.0,
        z: float | None = None,
        frame: Frame = Frame.WORLD,
        turning: Turning | None = None,
    ) -> None:
        """Takes the velocity.

        Args:
            velocity: Along x and y, metres a second.
            duration: Seconds.
            climb: Metres a second, upward.
            z: Height to keep in place of that, metres.
            frame: Of x and y.
            turning: Where drones look meanwhile.

        Raises:
            InputError: Drones are to look where they go, which in their own frame is nowhere else.
        """
        self.limit, self.velocity, self.climb, self.z = duration, velocity, climb, z
        self.frame, self.turning = frame, turning or Turning()
        if frame == Frame.BODY and self.turning.is_forward:
            raise InputError(
                "frame=body turns with the drone, so drivetrain=forward_only has nowhere to look; "
                "give frame=world, or max_degree_of_freedom"
            )

    def begin(self, body: FlightState) -> None:
        """See `Command`."""
        self.turning.begin(body.heading)

    def goals(self, body: FlightState) -> Goals:
        """See `Command`."""
        sideways = Mode.VELOCITY if self.frame == Frame.WORLD else Mode.HEADING_VELOCITY
        up = Mode.VELOCITY if self.z is None else Mode.POSITION
        modes: Modes = (sideways, sideways, self.turning.mode, up)
        travel = torch.tensor([*self.velocity, 0.0], dtype=torch.float64).repeat(len(body), 1)
        heading = self.turning.goal(travel, ACCURACY)
        height = self.climb if self.z is None else self.z
        return goals_of(body, modes, *self.velocity, heading, height)
