"""One drone and all that its pilot can tell it."""

import copy
from collections.abc import Sequence

from torch import Tensor

from drone_rl.flight.commands.auto_flight import AutoFlight
from drone_rl.flight.commands.errors import PilotError
from drone_rl.flight.commands.navigation import Navigation
from drone_rl.sim.dynamics.body import heading_only
from drone_rl.sim.entities import FRONT_CENTER
from drone_rl.sim.image_types import ImageRequest, images
from drone_rl.sim.rendering.view import Modality
from drone_rl.sim.tasks import State
from drone_rl.sim.worlds import Worlds


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
        worlds, state = self._seen("picture")
        return worlds.render(state, worlds.view(camera, modality, height, width))[0]

    def images(
        self,
        requests: Sequence[ImageRequest],
        *,
        height: int | None = None,
        width: int | None = None,
    ) -> list[Tensor]:
        """AirSim's images of its `worlds`, all of one size: any of five cameras, of seven types.

        Args:
            requests: Which camera and type each is of.
            height: Pixels; the worlds' choice by default.
            width: Pixels.

        Returns:
            One each. Shapes: (H, W, 3), uint8; or (H, W), float32, of those asked for as numbers.

        Raises:
            PilotError: It has no worlds to see.
            InputError: Nothing is asked for, or a size is out of range.
        """
        worlds, state = self._seen("images")
        return [found[0] for found in images(worlds, state, requests, height=height, width=width)]

    def _seen(self, name: str) -> tuple[Worlds, State]:
        """Its worlds, and what they are like with its own drone in them.

        Raises:
            PilotError: It has none.
        """
        if self.worlds is None:
            raise PilotError(f"{name}: there is nothing to see; give worlds=Worlds(1, ...)")
        state, body = copy.copy(self.worlds.state), self._drone.body
        is_level = self._drone.quadrotor.mount == "gimbal"
        state.body = body.moved(body.position, heading_only(body.attitude)) if is_level else body
        return self.worlds, state
