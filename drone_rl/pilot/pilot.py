"""One drone and all that its pilot can tell it."""

import copy

from torch import Tensor

from drone_rl.pilot.auto_flight import AutoFlight
from drone_rl.pilot.errors import PilotError
from drone_rl.pilot.navigation import Navigation
from drone_rl.sim.dynamics.body import heading_only
from drone_rl.sim.entities.cameras import FRONT_CENTER
from drone_rl.sim.rendering.view import Modality


class Pilot(AutoFlight, Navigation):
    """Flies one drone by the commands of AirSim (Tables 2 and 3), over simulated time.

    World frame: x forward, y left, z up, metres; angles in degrees, positive with the right side
    down (roll), the nose down (pitch), and to the left (yaw). The drone begins on the ground,
    disarmed. No command looks at a clock: time passes while one is waited for, or by `advance`.

    A command is waited for, and says whether it did what was asked for in time; with `wait=False`
    it returns a `FlightFuture` at once. It ends the one before it. Then the drone stays where the
    command has led, or where it is 0.06 s later.

    >>> with Pilot(wind=[5, 0, 0]) as pilot:
    ...     pilot.arm()
    ...     pilot.take_off()
    ...     pilot.move_to(10, 0, 5, speed=3)
    ...     pilot.land()
    """

    def picture(
        self,
        camera: str = FRONT_CENTER.name,
        modality: Modality = "rgb",
        height: int | None = None,
        width: int | None = None,
    ) -> Tensor:
        """What one of the drone's cameras sees of its `worlds`; level if they hang in a gimbal.

        Args:
            camera: One of AirSim's five, by name.
            modality: What of it, see `Renderer.render`.
            height: Pixels; the worlds' choice by default.
            width: Pixels.

        Raises:
            PilotError: It has no worlds to see.
        """
        if self.worlds is None:
            raise PilotError("picture: there is nothing to see; give worlds=Worlds(1, ...)")
        state, body = copy.copy(self.worlds.state), self._drone.body
        is_level = self._drone.quadrotor.mount == "gimbal"
        state.body = body.moved(body.position, heading_only(body.attitude)) if is_level else body
        return self.worlds.render(state, self.worlds.view(camera, modality, height, width))[0]
