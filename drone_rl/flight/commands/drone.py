"""A simulated drone with its clock, arming, sensors, cameras, scene and running command.

In computer-vision mode (Table 1) it has poses without dynamics.
"""

import copy
import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Self

import numpy as np
import torch
from torch import Tensor

from drone_rl.config import DynamicsSettings
from drone_rl.config.sensors import SensorSettings
from drone_rl.flight.commands import checks
from drone_rl.flight.commands.checks import Degrees, Duration, checked
from drone_rl.flight.commands.command import (
    Command,
    FlightFuture,
    Land,
    PilotError,
    all_rotors,
    hold,
    period_ticks,
)
from drone_rl.flight.commands.path_following import GoHomeCommand
from drone_rl.flight.commands.state import LandedState, PilotState, Trajectory
from drone_rl.flight.image_types import ImageRequest, images
from drone_rl.sim.coordinates import attitude_of, to_simulator
from drone_rl.sim.dynamics import FlightGoals, FlightState, Obstacles, Quadrotor
from drone_rl.sim.dynamics import state as fs
from drone_rl.sim.dynamics.state import twist_about_z
from drone_rl.sim.entities import FRONT_CENTER, find_camera
from drone_rl.sim.rendering.view import Modality
from drone_rl.sim.sensors import Sensors
from drone_rl.sim.tasks import State
from drone_rl.sim.tasks.objects import ObjectState
from drone_rl.sim.worlds import Worlds
from drone_rl.utils.errors import InputError, did_you_mean
from drone_rl.utils.schema import Instance, OneOf, Several, Whole

COASTING = 0.06
"""Seconds for which the last goals hold after a command that leaves no position to hold."""
_MODES = ("simple_flight", "computer_vision")
_IDLE = 0.1
"""Thrust of idle rotors as a fraction of the hover thrust."""
_LEAST_THRUST = 0.1
"""Mean thrust fraction above which a drone that moves vertically is flying; half the hover thrust
if that is less, as with strong rotors."""
_CLIMBS = 0.01
"""Vertical speed that counts as moving, m/s."""
_AT_REST = 0.08
"""Speed in m/s, and turn rate in rad/s, below which a drone on the ground has landed."""


STEP = 0.25
"""Metres that a key moves the drone."""
TURN = 5.0
"""Degrees that a key turns the drone."""
_AXES = {
    "forward backward": STEP,
    "left right": STEP,
    "up down": STEP,
    "roll_right roll_left": TURN,
    "pitch_up pitch_down": TURN,
    "yaw_right yaw_left": TURN,
}
KEYS: Mapping[str, tuple[int, float]] = {
    key: (axis, sign * step)
    for axis, (pair, step) in enumerate(_AXES.items())
    for key, sign in zip(pair.split(), (1.0, -1.0), strict=True)
}
"""Which number each key changes, and by how much: metres forward, left and up in the drone's
heading; degrees of roll, pitch and yaw."""
_GONE = (math.nan, math.nan, math.nan)


class Drone:
    """One drone that runs commands and hovers between them; `Pilot` adds the commands.

    A new command replaces the running one. Simulated time advances only by `advance`, or while a
    command is waited for.
    """

    lifts_off = False
    """Whether any movement takes off from the ground, as in AirSim."""
    kept_states: int | None = None
    """States that the trajectory keeps; all by default."""

    def __init__(
        self,
        dynamics: DynamicsSettings | Quadrotor | None = None,
        *,
        mode: str = "simple_flight",
        start: Sequence[float] = (0.0, 0.0),
        yaw: float = 0.0,
        seed: int = 0,
        obstacles: Obstacles | None = None,
        worlds: Worlds | None = None,
        sensors: SensorSettings | None = None,
        **changes: Any,
    ) -> None:
        """Put a disarmed drone on the ground.

        Args:
            dynamics: Vehicle and wind; those of `worlds` if it has vehicle dynamics, else AirSim's
                generic drone in still air.
            mode: simple_flight, or computer_vision without dynamics (Table 1): then only poses can
                be set.
            start: Position x and y, metres; in computer-vision mode also z.
            yaw: Heading, degrees to the right of the world's x axis.
            seed: Seed of gusts and sensor noise.
            obstacles: Obstacles in one world; those of `worlds` by default.
            worlds: A single world that the cameras render.
            sensors: Sensor settings; the sensors then run from the start.
            changes: Dynamics settings to change, such as wind=[5, 0, 0].
        """
        if worlds is not None:
            Instance(Worlds).read(worlds, "worlds")
            if worlds.num_envs != 1:
                raise InputError(f"worlds has {worlds.num_envs} worlds; give Worlds(1, ...)")
            if dynamics is None and isinstance(worlds.dynamics, Quadrotor):
                dynamics = worlds.dynamics.settings
        self.is_computer_vision = OneOf(_MODES).read(mode, "mode") == "computer_vision"
        """Whether there are no dynamics."""
        self._quadrotor = checks.quadrotor(dynamics, changes)
        self.settings = self._quadrotor.settings
        """Vehicle and wind."""
        height = [] if self.is_computer_vision and np.size(start) == 3 else [self.settings.radius]
        coordinates = checks.numbers(start, "start", 3 - len(height))
        place = [[*coordinates, *height]]
        attitude = attitude_of(0.0, 0.0, checks.DEGREES.read(yaw, "yaw"))
        self._seed = Whole(0, 2**31 - 1).read(seed, "seed")
        self.body = FlightState.at_rest(
            torch.tensor(place, dtype=torch.float64),
            attitude[None],
            torch.tensor([self._seed]),
        )
        """The state as the simulator has it; a batch of one."""
        self.home = self.body.position[0].clone()
        """Starting position, metres. Shape: (3,)."""
        self.worlds, self._obstacles = worlds, obstacles
        sensors = Instance(SensorSettings | None).read(sensors, "sensors")
        self._initial = copy.deepcopy((self.body, worlds.state if worlds else None, sensors))
        self.has_api_control = True
        """Whether commands are accepted; see `enable_api_control`."""
        self._period = period_ticks(self.settings)
        self.running: FlightFuture | None = None
        """The running command, if any."""
        self._begin(sensors)

    def _begin(self, sensors: SensorSettings | None) -> None:
        self.trajectory = Trajectory(self.kept_states)
        """The states since the drone was created or last reset."""
        self.trajectory.append(self.time, self.body)
        self._sensors = None if sensors is None else Sensors(self.body, sensors, self._seed)
        self._is_armed, self._landed = False, LandedState.LANDED
        self._goals: FlightGoals | None = None
        """Goals of the current control period."""
        self._left = 0
        """Remaining ticks of the period."""
        self._coasting = 0
        """Ticks for which the last goals hold after a command that set no position."""
        self._place: list[float] | None = None
        """Pose to hold without a command."""

    def __enter__(self) -> Self:
        """Return the drone."""
        return self

    def __exit__(self, *exception: object) -> None:
        """Cancel the running command."""
        self.cancel()

    def _repr_html_(self) -> str:
        return self.state._repr_html_()

    @property
    def time(self) -> float:
        """Simulated seconds since the drone was created or last reset."""
        return int(self.body.numbers.numpy()[0, fs.TICKS]) * self.settings.tick

    @property
    def state(self) -> PilotState:
        """Position, velocity, attitude, arming, landing state and last contact."""
        return PilotState.of(self.body, self.time, self._landed, self._is_armed)

    @property
    def sensors(self) -> Sensors:
        """IMU, barometer, magnetometer and GPS receiver.

        Without `sensors` at creation, AirSim's sensors are turned on at the first access; they cost
        nothing until then.
        """
        if self._sensors is None:
            self._sensors = Sensors(self.body, SensorSettings(), self._seed)
        return self._sensors

    def enable_api_control(self, enable: bool = True) -> None:
        """Accept commands and arming, or refuse both (`PilotError`) and cancel the running one."""
        self.has_api_control = enable
        if not enable:
            self.cancel()

    def reset(self) -> PilotState:
        """Put the drone, disarmed, and the objects back where they started; time starts at 0."""
        self.cancel()
        self.body, state, sensors = copy.deepcopy(self._initial)
        if self.worlds is not None and state is not None:
            self.worlds.state = state
        self._begin(sensors)
        return self.state

    @checked
    def advance(self, seconds: Duration) -> PilotState:
        """Advance simulated time and return the state; a negative duration is an `InputError`."""
        self._advance(self._ticks_of(seconds))
        return self.state

    def cancel(self) -> None:
        """Cancel the running command; the drone holds its position."""
        if self.running is not None:
            self.running.cancel()
            self._end(None)

    def arm(self) -> None:
        """Start the rotors; a `PilotError` in the air, without dynamics or with API control off."""
        self._require_dynamics("arm")
        if self._is_flying and not self._is_armed:
            raise PilotError("can't arm in the air; wait until the drone lies on the ground")
        self._is_armed = True

    def disarm(self, *, force: bool = False) -> None:
        """Stop the rotors, even with API control off; a `PilotError` in the air without `force`."""
        if self._is_flying and not force:
            raise PilotError("can't disarm in the air; land first, or let it fall by force=True")
        self._is_armed = False
        self.cancel()
        self._place, self._coasting, self._left = None, 0, 0

    def picture(
        self,
        camera: str | int = FRONT_CENTER.name,
        modality: Modality = "rgb",
        height: int | None = None,
        width: int | None = None,
    ) -> Tensor:
        """Render a camera, by AirSim's name or number; with dynamics, level if it has a gimbal.

        See `Renderer.render` for `modality`. The size, in pixels, is the worlds' by default. A
        drone without worlds raises `PilotError`.
        """
        worlds, state = self._scene("picture")
        name = find_camera(camera).name
        return worlds.render(state, worlds.view(name, modality, height, width))[0]

    def images(
        self,
        requests: Sequence[ImageRequest],
        *,
        height: int | None = None,
        width: int | None = None,
    ) -> list[Tensor]:
        """Render AirSim's images, any of five cameras and eight types, all of one size.

        The size, in pixels, is the worlds' by default. A drone without worlds raises `PilotError`.

        Returns:
            One tensor per request. Shapes: (H, W, 3), uint8; (H, W), float32, for `as_float`; or
            (bytes,), uint8, for `compress`: a PNG file.
        """
        requests = Several(Instance(ImageRequest), 1, 1000).read(requests, "requests")
        worlds, state = self._scene("images")
        return images(worlds, state, requests, height=height, width=width)

    @checked
    def set_pose(
        self, position: Any, *, roll: Degrees = 0.0, pitch: Degrees = 0.0, yaw: Degrees = 0.0
    ) -> PilotState:
        """Put the drone somewhere, in computer-vision mode; no time passes.

        Args:
            position: Metres, world frame.
            roll: Degrees; for the signs of angles see `conventions`.
            pitch: Degrees.
            yaw: Degrees.

        Raises:
            InputError: A number is not finite or out of range.
            PilotError: The mode is not computer_vision.
        """
        if not self.is_computer_vision:
            raise PilotError("set_pose: the drone has dynamics; make Pilot(mode='computer_vision')")
        place = checks.numbers(position, "position", 3)
        attitude = attitude_of(roll, pitch, yaw)[None]
        self.body = self.body.moved(torch.tensor([place], dtype=torch.float64), attitude)
        self.trajectory.append(self.time, self.body)
        return self.state

    @checked
    def press(self, key: str, times: Annotated[int, Whole(1, 100_000)] = 1) -> PilotState:
        """Move or turn the drone by the steps of a key, one of `KEYS`; see `set_pose` for errors.

        A key moves in the heading of the drone, level, by `STEP`, or changes an angle by `TURN`.
        """
        if key not in KEYS:
            raise InputError(
                f"key={key!r} is unknown; give one of: {', '.join(KEYS)}{did_you_mean(key, KEYS)}"
            )
        state = self.state
        axis, step = KEYS[key]
        change = [0.0] * 6
        change[axis] = times * step
        forward, left, up = change[:3]
        *_, heading = to_simulator(0.0, 0.0, math.radians(state.attitude.yaw))
        cos, sin = math.cos(heading), math.sin(heading)
        x, y, z = state.position
        there = (x + cos * forward - sin * left, y + sin * forward + cos * left, z + up)
        now = dataclasses.astuple(state.attitude)
        after = (old + part for old, part in zip(now, change[3:], strict=True))
        roll, pitch, yaw = (math.remainder(angle, 360.0) for angle in after)
        return self.set_pose(there, roll=roll, pitch=pitch, yaw=yaw)

    @property
    def object_names(self) -> tuple[str, ...]:
        """Names of the scene's objects, such as "cube_0"; none without worlds."""
        if self.worlds is None:
            return ()
        return tuple(prop.mjcf_model.model for prop in self.worlds.task.make_props())

    def object_position(self, name: str) -> tuple[float, float, float]:
        """Return the position of an object, metres, world frame; NaN if it has vanished.

        An unknown name is an `InputError`; a drone without worlds raises `PilotError`.
        """
        worlds, index = self._object(name)
        x, y, z = worlds.task.places(worlds.state)[0, index].tolist()
        present = getattr(worlds.state, "present", None)
        return (x, y, z) if present is None or bool(present[0, index]) else _GONE

    def set_object_position(self, name: str, position: Sequence[float]) -> None:
        """Move an object to a position, metres, world frame.

        Raises:
            InputError: The name is unknown or a number is invalid.
            PilotError: The drone has no worlds, or their task does not let objects move.
        """
        worlds, index = self._object(name)
        place = checks.numbers(position, "position", 3)
        if not isinstance(worlds.state, ObjectState):
            name = worlds.task.name
            raise PilotError(f"set_object_position: task {name} does not let objects move")
        worlds.state.places[0, index] = torch.tensor(place, dtype=torch.float64)

    def _object(self, name: str) -> tuple[Worlds, int]:
        if self.worlds is None:
            raise PilotError("there are no objects; give worlds=Worlds(1, ...)")
        names = self.object_names
        if name not in names:
            options = f"{', '.join(names)}{did_you_mean(name, names)}"
            raise InputError(f"object {name!r} is unknown; give one of: {options}")
        return self.worlds, names.index(name)

    def _scene(self, name: str) -> tuple[Worlds, State]:
        if self.worlds is None:
            raise PilotError(f"{name}: there is nothing to render; give worlds=Worlds(1, ...)")
        state, body = copy.copy(self.worlds.state), self.body
        is_level = self._quadrotor.mount == "gimbal" and not self.is_computer_vision
        state.body = body.moved(body.position, twist_about_z(body.attitude)) if is_level else body
        return self.worlds, state

    @property
    def _around(self) -> Obstacles | None:
        if self._obstacles is None and self.worlds is not None:
            return self.worlds.task.obstacles(self.worlds.state)
        return self._obstacles

    @property
    def _is_flying(self) -> bool:
        return self._landed == LandedState.FLYING

    @property
    def _is_lost(self) -> bool:
        return bool(self.body.numbers.numpy()[0, fs.LOST])  # faster than an index of a tensor

    def _require_dynamics(self, name: str) -> None:
        if not self.has_api_control:
            raise PilotError(f"{name}: API control is off; call enable_api_control() first")
        if self.is_computer_vision:
            raise PilotError(f"{name}: computer-vision mode has no dynamics; use set_pose or press")

    def _require_armed(self, name: str) -> None:
        self._require_dynamics(name)
        if self._is_lost:
            raise PilotError(f"{name}: the simulation has diverged; make a new Pilot")
        if not self._is_armed:
            raise PilotError(f"{name}: the drone isn't armed; call arm() first")

    def _run(self, name: str, command: Command, wait: bool) -> bool | FlightFuture:
        """Start a command that only a flying drone can run, unless it `lifts_off`."""
        self._require_armed(name)
        if not self._is_flying and not self.lifts_off:
            raise PilotError(f"{name}: the drone is on the ground; call take_off() first")
        return self._start(name, command, wait)

    def _start(self, name: str, command: Command, wait: bool) -> bool | FlightFuture:
        self.cancel()
        self.running = future = FlightFuture(name, command, self._finish)
        self._left = 0
        if command.limit <= 0.0:
            self._end(command.succeeds_at_limit)
        return future.result() if wait else future

    def _finish(self, future: FlightFuture) -> None:
        """Advance simulated time until a command ends."""
        while not future.done:
            self._advance(self._left or self._period)

    def _ticks_of(self, seconds: float) -> int:
        return math.ceil(seconds / self.settings.tick - 1e-9)

    def _advance(self, ticks: int) -> None:
        while ticks > 0:
            if self._left == 0:
                self._goals, self._left = self._next_goals(), self._period
            now = min(ticks, self._left)
            self._fly(self._goals, now)
            ticks, self._left = ticks - now, self._left - now
            self._coasting = max(0, self._coasting - now)
            if self.running is not None:
                self.running.elapsed += now * self.settings.tick
                if self._left == 0:
                    self._check(self.running)

    def _next_goals(self) -> FlightGoals | None:
        """Return the goals of the next control period; None for idle rotors."""
        if self.running is not None:
            return self.running.command.goals(self.body)
        if self._coasting > 0:
            return self._goals
        if not self._is_flying:
            self._place = None
            return None
        if self._place is None:
            self._place = self.body.settled().reference[0].tolist()
        return hold(self._place)

    def _fly(self, goals: FlightGoals | None, ticks: int) -> None:
        if self.is_computer_vision:
            self.body.numbers[:, fs.TICKS] += ticks
            self._record(ticks)
            return
        if not self._is_armed:
            goals = all_rotors(0.0)
        elif goals is None:
            goals = all_rotors(_IDLE * self.settings.hover_throttle)
        if not self._is_lost:
            self.body = self._quadrotor.fly(self.body, goals, ticks, self._around)
        if self._is_lost:  # the drone stays at its last valid state
            self.body.numbers[:, fs.TICKS] += ticks
        self._record(ticks)
        self._update_landed()

    def _record(self, ticks: int) -> None:
        """Record the state and update the sensors."""
        self.trajectory.append(self.time, self.body)
        if self._sensors is not None:
            self._sensors.update(self.body, ticks * self.settings.tick)

    def _update_landed(self) -> None:
        """Detect take-off and landing."""
        row = self.body.numbers.numpy()[0].tolist()
        least = min(_LEAST_THRUST, 0.5 * self.settings.hover_throttle)
        pushes = sum(row[fs.ROTORS : fs.ROTORS + 4]) / 4 > least
        if not self._is_flying:
            if pushes and abs(row[fs.VELOCITY + 2]) > _CLIMBS:
                self._landed = LandedState.FLYING
            return
        last = self.time - 2.5 * self.settings.tick
        if pushes or row[fs.THING] == fs.NOTHING or row[fs.TIME] <= last:
            return
        turns = math.hypot(*row[fs.RATES : fs.ROTORS])
        if max(math.hypot(*row[fs.VELOCITY : fs.RATES]), turns) < _AT_REST:
            self._settle()

    def _settle(self) -> None:
        """Mark the drone as landed and reset the climb controller."""
        self._landed = LandedState.LANDED
        self.body.numbers[:, fs.CLIMB_INTEGRAL] = 2.0 * self.settings.hover_throttle - 1.0

    def _check(self, future: FlightFuture) -> None:
        """End the command if it is complete, over time, or the drone is lost."""
        command = future.command
        if self._is_lost:
            self._end(False)
        elif command.is_complete(self.body):
            self._end(True)
        elif future.elapsed >= command.limit - 1e-9:
            self._end(command.succeeds_at_limit)

    def _end(self, success: bool | None) -> None:
        """End the running command (None: cancelled) and choose the pose to hold afterwards."""
        future, self.running = self.running, None
        assert future is not None
        command, self._place, self._left = future.command, None, 0
        self._coasting = self._ticks_of(COASTING)
        if success is None:
            return
        future.finish(success)
        if success:
            self._place = command.rest(self.body)
        if success and isinstance(command, Land | GoHomeCommand):
            self._settle()
        if self._place is not None:
            self.body.reference[0] = torch.tensor(self._place)
        if self._place is not None or not self._is_flying:
            self._coasting = 0
