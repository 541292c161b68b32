"""Taking off: straight up, to where other commands are obeyed."""

from torch import Tensor

from drone_rl.flight.commands.along import AlongPath
from drone_rl.sim.dynamics import FlightState

TAKE_OFF_HEIGHT = 2.0
"""Metres above where it stands to which a drone takes off."""
TAKE_OFF_SPEED = 0.5
"""Metres a second."""
_THERE = 0.1
"""Metres below that height at which it is done; beside it counts for nothing, since there is wind.
"""


class TakeOff(AlongPath):
    """A way up."""

    def __init__(self, body: FlightState, limit: float) -> None:
        """Takes who takes off, and seconds after which that has failed."""
        up = body.position.new_tensor([0.0, 0.0, TAKE_OFF_HEIGHT])
        super().__init__((body.position + up)[:, None], TAKE_OFF_SPEED, limit)

    def is_complete(self, body: FlightState) -> Tensor:
        """At the height."""
        return body.position[:, 2] >= self.paths.ends[:, 2] - _THERE
