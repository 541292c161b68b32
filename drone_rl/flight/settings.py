"""Settings of the page to fly from, and of the server for AirSim's clients."""

from typing import Annotated, Literal

from drone_rl.config import RendererName
from drone_rl.config.camera import RendererSettings
from drone_rl.config.values import Seed
from drone_rl.utils.schema import OneOf, Real, Whole
from drone_rl.utils.settings import Settings

CAMERAS = (
    "front_center",
    "front_right",
    "front_left",
    "bottom_center",
    "back_center",
    "chase",
)
"""AirSim's five cameras, and the view from behind the drone."""
FLY_MODES = ("actions", "computer_vision", "simple_flight")
"""How a person flies: by the policy's actions, by steps of the pose, or by velocities."""


class FlySettings(RendererSettings):
    """Settings of the page to fly from."""

    view: Annotated[str, OneOf(CAMERAS)] = "front_center"
    """Camera of the large image: one of AirSim's five, or chase, from behind the drone."""
    mode: Annotated[str, OneOf(FLY_MODES)] = "actions"
    """Controls of a person: actions, those of the policy; computer_vision, steps of 0.25 m and 5
    degrees; or simple_flight, velocities of a drone with dynamics."""
    greedy: bool = True
    """Whether the policy takes the most probable action instead of sampling."""
    saliency: bool = True
    """Whether to test heat maps in the background and show the best one that passes."""
    seed: Seed = 0
    """Root of the environment's random streams."""
    port: Annotated[int, Whole(0, 65535)] = 0
    """Port at 127.0.0.1; 0 for a free one."""
    frames_per_second: Annotated[int, Whole(1, 60, unit="1/s")] = 40
    """Images per second that the page is sent; slow browsers get fewer."""
    demonstrations: str | None = None
    """Folder to which recorded flights are added; null for outputs/demonstrations."""


class ServeSettings(Settings):
    """Settings of the server for AirSim's clients."""

    scene: str = "cubes"
    """Objects in the scene: cubes, which vanish when touched; blocks; pillars; empty; indoor;
    outdoor; or the path of an MJCF file or mesh, in which vehicles start below the first site
    start*, else in free space near to its origin."""
    clock: Literal["wall", "lockstep"] = "wall"
    """wall: real time, multiplied by ClockSpeed. lockstep: time advances only while a call waits
    for it, as fast as the machine can, with the same results every time if clients send their
    requests within `patience_s` of each other."""
    date: str = "2024-01-01T00:00:00"
    """Time at which lockstep starts, as ISO 8601, UTC: time stamps count nanoseconds from 1970.
    With the wall clock they start at the present time."""
    patience_s: Annotated[float, Real(0.0, 60.0, unit="s")] = 0.02
    """Real seconds without a request before time advances for a waiting call in lockstep. Give more
    for a client that computes long between the start of a movement and its next request."""
    address: str | None = None
    """Address to listen at; null for that of the settings file, 127.0.0.1 by default."""
    port: Annotated[int, Whole(0, 65535)] | None = None
    """Port; null for that of the settings file, 41451 by default; 0 for a free one."""
    seed: Annotated[int, Whole(0, 2**31 - 1)] = 0
    """Seed of the placement of cubes and pillars, of gusts and of sensor noise."""
    raw_channels: Annotated[int, Whole(3, 4)] = 3
    """Channels of raw images of AirSim's clients from version 1.2 on: 3 (blue, green, red), or 4
    (red, green, blue, opacity) for programs that were written for AirSim 1.2."""
    renderer: RendererName | None = None
    """raytrace or mujoco_warp; null for the one that fits the scene."""
