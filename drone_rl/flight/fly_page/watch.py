"""The page without controls: it shows what a client's program does on AirSim's server."""

import asyncio
import concurrent.futures
import copy
import math
from typing import Any, Literal

from PIL import Image
from torch import Tensor

from drone_rl.flight.airsim.messages import to_world
from drone_rl.flight.airsim.serving import RunningServer
from drone_rl.flight.airsim.simulation import Simulation
from drone_rl.flight.fly_page.flight import JPEG_QUALITY, Camera, message, packed, pose_of
from drone_rl.flight.fly_page.server import FlyPage
from drone_rl.flight.fly_page.world import HEIGHT, WIDTH
from drone_rl.flight.image_types import ImageType, encode
from drone_rl.flight.settings import CAMERAS
from drone_rl.sim.entities import CHASE
from drone_rl.trust.video import render_chase

_FRAMES_PER_SECOND = 20
_PATIENCE_S = 5.0
"""Seconds to wait for a frame."""
_MESSAGE = message(type=Literal["camera"], camera=Camera)


class Watched:
    """Shows the first vehicle of a simulation. Browsers choose the camera.

    The simulation belongs to the thread of an event loop, which makes the frames.
    """

    def __init__(self, simulation: Simulation, loop: asyncio.AbstractEventLoop) -> None:
        """Take the simulation and its loop."""
        self._simulation, self._loop = simulation, loop
        self._camera, self._number = CHASE.name, 0

    def handle(self, message: Any) -> None:
        """Do what a browser's message says; an `InputError` if it is not a choice of a camera."""
        self._camera = dict(_MESSAGE.read(message, "message"))["camera"]

    def advance(self, seconds: float) -> None:
        """Do nothing: the program that is watched lets time pass."""

    def release(self) -> None:
        """Do nothing: there are no controls."""

    def close(self) -> None:
        """Do nothing: the simulation goes on."""

    def hello(self) -> dict[str, Any]:
        """Return what does not change; see `Flight.hello`."""
        scene = f"scene {self._simulation.stage.scene_name}, clock {self._simulation.clock}"
        texts = {"title": "Watch a program fly", "task": f"AirSim's server: {scene}."}
        return {"watch": True, "texts": texts, "object": "object", "size": 1.0, "cameras": CAMERAS}

    def frame(self) -> bytes:
        """Return the present state and image, see `flight.packed`; nothing if the loop is busy."""
        making = self._frame()
        try:
            made = asyncio.run_coroutine_threadsafe(making, self._loop)
            return made.result(_PATIENCE_S)
        except (TimeoutError, concurrent.futures.CancelledError):
            return b""
        except RuntimeError:  # the loop has ended
            making.close()
            return b""

    async def _frame(self) -> bytes:
        self._number += 1
        image = Image.fromarray(self._render().numpy())
        images = [("view", "image/jpeg", encode(image, "jpeg", quality=JPEG_QUALITY))]
        return packed({"frame": self._number, **self._state()}, images)

    def _state(self) -> dict[str, Any]:
        simulation, stage = self._simulation, self._simulation.stage
        vehicle = simulation.find("")
        places = (to_world(stage.object_pose(name).position) for name in stage.movable)
        return {
            "time": round(simulation.time, 3),
            "episode": vehicle.epoch,
            "camera": self._camera,
            **pose_of(vehicle.body),
            "objects": [None if math.isnan(place[0]) else place for place in places],
            "texts": {
                "flyer": f"A program flies {vehicle.name}",
                "note": "Time is paused." if simulation.is_paused else "",
            },
        }

    def _render(self) -> Tensor:
        """Render the vehicle from behind, or one of its cameras. Shape: (H, W, 3), uint8."""
        stage, vehicle = self._simulation.stage, self._simulation.find("")
        if self._camera != CHASE.name:
            (shot,) = stage.render(vehicle.body, vehicle.cameras[self._camera], [ImageType.SCENE])
            return stage.image(ImageType.SCENE, shot, as_float=False)
        worlds = copy.copy(stage.worlds)
        worlds.state = copy.copy(worlds.state)
        worlds.state.body = vehicle.body
        return render_chase(worlds, stage.appearance, HEIGHT, WIDTH)[0]


def watch(server: RunningServer) -> FlyPage:
    """Start a page that shows a server's simulation, in threads of this process.

    Raises:
        InputError: The extra `fly` is not installed.
    """
    return FlyPage(
        lambda: Watched(server.simulation, server.loop),
        port=0,
        frames_per_second=_FRAMES_PER_SECOND,
    )
