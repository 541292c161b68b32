"""Base class of `Pilot`: the drone's clock, arming, sensors and images."""

import copy
import math
from collections.abc import Sequence
from typing import Any, Self

import torch
from torch import Tensor

from drone_rl.config import DynamicsSettings
from drone_rl.config.sensors import SensorSettings
from drone_rl.flight.commands import checks
from drone_rl.flight.commands.command import Command, FlightFuture, PilotError
from drone_rl.flight.commands.drone import Drone, Runner, Sensors
from drone_rl.flight.commands.movement import Sticks
from drone_rl.flight.commands.state import PilotState, Trajectory, state_html
from drone_rl.sim.dynamics import Obstacles, Quadrotor
from drone_rl.sim.dynamics.state import heading_only
from drone_rl.sim.entities import FRONT_CENTER
from drone_rl.sim.image_types import ImageRequest, images
from drone_rl.sim.rendering.view import Modality
from drone_rl.sim.tasks import State
from drone_rl.sim.worlds import Worlds
from drone_rl.utils.errors import InputError
from drone_rl.utils.schema import Whole


class BasePilot:
    """One drone with its clock, sensors and cameras; `Pilot` adds the movement commands."""

    def __init__(
        self,
        dynamics: DynamicsSettings | Quadrotor | None = None,
        *,
        start: Sequence[float] = (0.0, 0.0),
        yaw: float = 0.0,
        seed: int = 0,
        obstacles: Obstacles | None = None,
        worlds: Worlds | None = None,
        sensors: SensorSettings | None = None,
        **changes: Any,
    ) -> None:
        """Put a drone on the ground.

        Args:
            dynamics: Vehicle and wind; those of `worlds` if it has vehicle dynamics, else AirSim's
                generic drone in still air.
            start: Position x and y, metres.
            yaw: Heading, degrees to the left of the world's x axis.
            seed: Seed of gusts and sensor noise.
            obstacles: Obstacles in one world; those of `worlds` by default.
            worlds: A single world that the cameras render.
            sensors: Sensor settings; the sensors then run from the start.
            changes: Dynamics settings to change, such as wind=[5, 0, 0].

        Raises:
            InputError: A setting is invalid.
        """
        if worlds is not None:
            if worlds.num_worlds != 1:
                raise InputError(f"worlds has {worlds.num_worlds} worlds; give Worlds(1, ...)")
            if dynamics is None and isinstance(worlds.dynamics, Quadrotor):
                dynamics = worlds.dynamics.settings
            if obstacles is None:
                obstacles = worlds.task.obstacles(worlds.state)
        quadrotor = _quadrotor(dynamics, changes)
        x, y = checks.numbers(start, "start", 2, -checks.FARTHEST, checks.FARTHEST)
        place = torch.tensor([x, y, quadrotor.settings.radius], dtype=torch.float64)
        heading = math.radians(checks.real(yaw, "yaw", unit="degrees"))
        self._seed = Whole(0, 2**31 - 1).read(seed, "seed")
        self._drone = Drone(quadrotor, place, heading, self._seed)
        self._drone.obstacles = obstacles
        self._runner = Runner(self._drone)
        self.worlds = worlds
        if sensors is not None:
            self._drone.sensors = Sensors(self._drone.body, sensors, self._seed)
        self.sticks = Sticks()
        """Stick positions for `move_by_manual`; may be replaced at any time."""

    def __enter__(self) -> Self:
        """Return the pilot."""
        return self

    def __exit__(self, *exception: object) -> None:
        """Cancel the running command."""
        self._runner.cancel()

    @property
    def state(self) -> PilotState:
        """Position, velocity, attitude, arming, landing state and last contact."""
        return self._drone.state

    @property
    def time(self) -> float:
        """Simulated seconds since the drone was created."""
        return self._drone.time

    @property
    def trajectory(self) -> Trajectory:
        """The states of all control periods so far."""
        return self._drone.trajectory

    @property
    def sensors(self) -> Sensors:
        """IMU, barometer, magnetometer, GPS and collision sensor.

        Without `sensors` at creation, AirSim's sensors are turned on at the first access; they cost
        nothing until then.
        """
        drone = self._drone
        if drone.sensors is None:
            drone.sensors = Sensors(drone.body, SensorSettings(), self._seed)
        return drone.sensors

    @property
    def settings(self) -> DynamicsSettings:
        """Vehicle and wind."""
        return self._drone.quadrotor.settings

    @property
    def running(self) -> FlightFuture | None:
        """The running command, if any."""
        return self._runner.running

    def advance(self, seconds: float) -> PilotState:
        """Advance simulated time and return the state.

        Raises:
            InputError: The duration is negative.
        """
        self._runner.advance(self._drone.ticks_of(checks.duration(seconds)))
        return self.state

    def cancel(self) -> None:
        """Cancel the running command; the drone holds its position."""
        self._runner.cancel()

    def arm(self) -> None:
        """Start the rotors.

        Raises:
            PilotError: The drone is in the air.
        """
        if self._drone.is_flying and not self._drone.armed:
            raise PilotError("can't arm in the air; wait until the drone lies on the ground")
        self._drone.armed = True

    def disarm(self, *, force: bool = False) -> None:
        """Stop the rotors.

        Args:
            force: Also in the air; the drone then falls.

        Raises:
            PilotError: The drone is in the air and `force` is False.
        """
        if self._drone.is_flying and not force:
            raise PilotError("can't disarm in the air; land first, or let it fall by force=True")
        self._drone.armed = False
        self._runner.reset()

    def picture(
        self,
        camera: str = FRONT_CENTER.name,
        modality: Modality = "rgb",
        height: int | None = None,
        width: int | None = None,
    ) -> Tensor:
        """Render one of the drone's cameras; level if the cameras hang in a gimbal.

        Args:
            camera: Name of one of AirSim's five cameras.
            modality: See `Renderer.render`.
            height: Pixels; the worlds' setting by default.
            width: Pixels; the worlds' setting by default.

        Raises:
            PilotError: The pilot has no worlds.
        """
        worlds, state = self._scene("picture")
        return worlds.render(state, worlds.view(camera, modality, height, width))[0]

    def images(
        self,
        requests: Sequence[ImageRequest],
        *,
        height: int | None = None,
        width: int | None = None,
    ) -> list[Tensor]:
        """Render AirSim's images: any of five cameras and seven types, all of one size.

        Args:
            requests: Camera and type of each image.
            height: Pixels; the worlds' setting by default.
            width: Pixels; the worlds' setting by default.

        Returns:
            One tensor a request. Shapes: (H, W, 3), uint8; or (H, W), float32, for `as_float`.

        Raises:
            PilotError: The pilot has no worlds.
            InputError: There are no requests, or a size is out of range.
        """
        worlds, state = self._scene("images")
        return [found[0] for found in images(worlds, state, requests, height=height, width=width)]

    def _scene(self, name: str) -> tuple[Worlds, State]:
        """Return the worlds and their state with this drone in it."""
        if self.worlds is None:
            raise PilotError(f"{name}: there is nothing to render; give worlds=Worlds(1, ...)")
        state, body = copy.copy(self.worlds.state), self._drone.body
        is_level = self._drone.quadrotor.mount == "gimbal"
        state.body = body.moved(body.position, heading_only(body.attitude)) if is_level else body
        return self.worlds, state

    def _require_armed(self, name: str) -> None:
        if self._drone.is_lost:
            raise PilotError(f"{name}: the simulation has diverged; make a new Pilot")
        if not self._drone.armed:
            raise PilotError(f"{name}: the drone isn't armed; call arm() first")

    def _fly(self, name: str, command: Command, wait: bool) -> bool | FlightFuture:
        """Start a command that only a flying drone can run.

        Raises:
            PilotError: The drone is not armed, or on the ground.
        """
        self._require_armed(name)
        if not self._drone.is_flying:
            raise PilotError(f"{name}: the drone is on the ground; call take_off() first")
        return self._start(name, command, wait)

    def _start(self, name: str, command: Command, wait: bool) -> bool | FlightFuture:
        future = self._runner.start(name, command)
        return future.result() if wait else future

    def _repr_html_(self) -> str:
        return state_html(self.state, self.trajectory)


def _quadrotor(dynamics: DynamicsSettings | Quadrotor | None, changes: dict[str, Any]) -> Quadrotor:
    if isinstance(dynamics, Quadrotor):
        if changes:
            raise InputError(f"{', '.join(changes)} and a Quadrotor are given; give settings alone")
        return dynamics
    return Quadrotor((dynamics or DynamicsSettings()).replace(mode="simple_flight", **changes))
