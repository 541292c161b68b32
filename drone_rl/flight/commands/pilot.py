"""One drone flown by AirSim's commands: automatic flight (Table 2) and navigation (Table 3)."""

import dataclasses
import math
from typing import Annotated, Any, Literal, TypedDict, Unpack

import torch

from drone_rl.flight.commands import checks
from drone_rl.flight.commands.checks import (
    Coordinate,
    Degrees,
    Duration,
    Height,
    Share,
    Speed,
    Tilt,
    Velocity,
    checked,
)
from drone_rl.flight.commands.command import (
    LANDING_SPEED,
    FlightFuture,
    Hover,
    Land,
    PilotError,
    RotateByCommand,
    RotateToCommand,
    TimedCommand,
    goals_of,
)
from drone_rl.flight.commands.drone import Drone
from drone_rl.flight.commands.path_following import (
    AUTOMATIC,
    TAKEOFF_SPEED,
    Drivetrain,
    GoHomeCommand,
    PathCommand,
    TakeoffCommand,
    YawControl,
    YawMode,
    braking_time,
)
from drone_rl.sim.coordinates import to_simulator
from drone_rl.sim.dynamics import FlightGoals, FlightState, Mode
from drone_rl.sim.dynamics.control import Modes, rotor_goals
from drone_rl.utils.errors import InputError
from drone_rl.utils.schema import Instance, Real

MOVING = 0.05
"""Speed in m/s above which a drone can't take off."""
YAW_AT_FULL_STICK = 100.0
"""Degrees (per second) that the yaw stick adds to the yaw mode."""
_FREE = Drivetrain.MAX_DEGREE_OF_FREEDOM


def speed_of(body: FlightState) -> float:
    """Return the speed of a single drone, m/s."""
    return float(body.velocity.norm())


@dataclasses.dataclass(frozen=True)
class Sticks:
    """Positions of a remote control's sticks, each from -1 to 1."""

    pitch: float = 0.0
    """Forward."""
    roll: float = 0.0
    """To the right."""
    throttle: float = 0.0
    """Up."""
    yaw: float = 0.0
    """To the right."""

    def __post_init__(self) -> None:
        """Check the positions."""
        for field in dataclasses.fields(self):
            number = Real(-1.0, 1.0).read(getattr(self, field.name), field.name)
            object.__setattr__(self, field.name, number)


class PathOptions(TypedDict, total=False):
    """Keyword arguments of `Pilot.move_along`."""

    drivetrain: str
    yaw_mode: YawMode | None
    lookahead: float
    adaptive_lookahead: float
    wait: bool


class Pilot(Drone):
    """Flies one drone by the commands of AirSim (Tables 2 and 3), over simulated time.

    World frame: x forward, y left, z up, metres. Angles are in degrees and have AirSim's signs:
    positive with the right side down (roll), the nose up (pitch), and to the right (yaw); see
    `conventions`. The drone starts on the ground, disarmed. Simulated time advances only while a
    command is waited for, or by `advance`.

    A command waits until it ends and returns whether it succeeded in time; with `wait=False` it
    returns a `FlightFuture` at once. A new command cancels the running one. After a command the
    drone holds the position that the command reached, or else the one it has 0.06 s later.

    With `mode="computer_vision"` there are no dynamics: `set_pose` and `press` move the drone, and
    all other movements are refused.

    `duration` and `timeout` are in seconds. A command fails after its timeout, by default three
    times its expected duration plus 10 s. `drivetrain` and `yaw_mode` are a `Drivetrain` and a
    `YawMode`. Every command raises `InputError` if a number is invalid or two alternatives are
    given, and `PilotError` if the drone isn't flying (`take_off`: isn't armed, or is moving).

    >>> with Pilot(wind=[5, 0, 0]) as pilot:
    ...     pilot.arm()
    ...     pilot.take_off()
    ...     pilot.move_to(10, 0, 5, speed=3)
    ...     pilot.land()
    """

    sticks = Sticks()
    """Stick positions for `move_by_manual`; may be replaced at any time."""

    @checked
    def take_off(
        self, timeout: Duration | None = None, *, wait: bool = True
    ) -> bool | FlightFuture:
        """Climb 2 m at 0.5 m/s."""
        self._require_armed("take_off")
        speed = speed_of(self.body)
        if speed > MOVING:
            raise PilotError(
                f"can't take off while moving at {speed:.2g} m/s; wait until the drone stands still"
            )
        return self._start("take_off", TakeoffCommand(self.body, timeout), wait)

    @checked
    def land(self, timeout: Duration | None = None, *, wait: bool = True) -> bool | FlightFuture:
        """Descend at 0.2 m/s until the drone stands."""
        height = float(self.body.position[0, 2])
        limit = checks.time_limit(timeout, height, LANDING_SPEED)
        return self._run("land", Land(self.body, limit), wait)

    @checked
    def go_home(
        self, timeout: Duration | None = None, *, speed: Speed = TAKEOFF_SPEED, wait: bool = True
    ) -> bool | FlightFuture:
        """Fly to the starting position at the present height and land there."""
        (x, y, _), height = self.home.tolist(), float(self.body.position[0, 2])
        braking = braking_time(self.settings)
        path = PathCommand(self.body, [(x, y, height)], speed, timeout, braking=braking)
        landing = checks.time_limit(None, height, LANDING_SPEED) if timeout is None else 0.0
        return self._run("go_home", GoHomeCommand(path, landing), wait)

    @checked
    def hover(self, duration: Duration = 0.0, *, wait: bool = True) -> bool | FlightFuture:
        """Hold the position for some seconds and afterwards."""
        return self._run("hover", Hover(self.body, duration), wait)

    @checked
    def move_by_angle(
        self,
        roll: Tilt,
        pitch: Tilt,
        duration: Duration,
        *,
        z: Height | None = None,
        throttle: Share | None = None,
        yaw: Degrees | None = None,
        yaw_rate: Degrees | None = None,
        wait: bool = True,
    ) -> bool | FlightFuture:
        """Hold roll (right side down) and pitch (nose up: backward), degrees.

        `z` is the height to hold, metres, the present one by default; in its place `throttle` is a
        fraction of the maximum thrust, 0 to 1. `yaw` is the heading, degrees to the right of the
        world's x axis, unchanged by default; in its place `yaw_rate` is in degrees per second.
        """
        if yaw is not None and yaw_rate is not None:
            raise InputError(f"yaw={yaw} and yaw_rate={yaw_rate} are both given; give one of them")
        value = yaw if yaw_rate is None else yaw_rate
        x, y, wanted = to_simulator(*map(math.radians, (roll, pitch, value or 0.0)))
        turn = float(self.body.heading[0]) if value is None else wanted
        turn_mode = Mode.ANGLE if yaw_rate is None else Mode.RATE
        lift_mode, lift = self._lift(z, throttle)
        modes: Modes = (Mode.ANGLE, Mode.ANGLE, turn_mode, lift_mode)
        goals = goals_of(modes, x, y, turn, lift)
        return self._hold("move_by_angle", goals, duration, wait)

    @checked
    def move_by_rates(
        self,
        roll: Degrees,
        pitch: Degrees,
        yaw: Degrees,
        duration: Duration,
        *,
        z: Height | None = None,
        throttle: Share | None = None,
        wait: bool = True,
    ) -> bool | FlightFuture:
        """Hold body rates, degrees per second; see `move_by_angle`."""
        x, y, turn = to_simulator(*map(math.radians, (roll, pitch, yaw)))
        lift_mode, lift = self._lift(z, throttle)
        goals = goals_of((Mode.RATE, Mode.RATE, Mode.RATE, lift_mode), x, y, turn, lift)
        return self._hold("move_by_rates", goals, duration, wait)

    @checked
    def move_by_rotors(
        self, shares: Any, duration: Duration, *, wait: bool = True
    ) -> bool | FlightFuture:
        """Set all rotors: front right, rear left, front left, rear right, each from 0 to 1."""
        rotors = checks.numbers(shares, "shares", 4, checks.SHARE)
        goals = rotor_goals(torch.tensor([rotors], dtype=torch.float64))
        return self._hold("move_by_rotors", goals, duration, wait)

    @checked
    def move_by_velocity(
        self,
        vx: Velocity,
        vy: Velocity,
        vz: Velocity = 0.0,
        duration: Duration = 1.0,
        *,
        z: Height | None = None,
        frame: Literal["world", "body"] = "world",
        drivetrain: str = _FREE,
        yaw_mode: YawMode | None = None,
        wait: bool = True,
    ) -> bool | FlightFuture:
        """Hold a velocity: forward, to the left and up, metres per second.

        `z` is the height to hold in place of `vz`, metres. `frame` is "world", or "body" for `vx`
        ahead of the drone and `vy` to its left, not with `Drivetrain.FORWARD_ONLY`.
        """
        if z is not None and vz != 0.0:
            raise InputError(f"z={z} and vz={vz:g} are both given; give one of them")
        control = YawControl(self.body, drivetrain, yaw_mode)
        is_body = frame == "body"
        if is_body and control.is_forward:
            raise InputError(
                "frame=body turns with the drone and can't be combined with "
                "drivetrain=forward_only; give frame=world, or max_degree_of_freedom"
            )
        sideways = Mode.HEADING_VELOCITY if is_body else Mode.VELOCITY
        height = vz if z is None else z
        up_mode = Mode.VELOCITY if z is None else Mode.POSITION
        modes: Modes = (sideways, sideways, control.mode, up_mode)

        def goals(body: FlightState) -> FlightGoals:
            return goals_of(modes, vx, vy, control.goal(vx, vy), height)

        return self._run("move_by_velocity", TimedCommand(goals, duration), wait)

    @checked
    def move_along(
        self,
        path: Any,
        speed: Speed = 1.0,
        timeout: Duration | None = None,
        *,
        drivetrain: str = _FREE,
        yaw_mode: YawMode | None = None,
        lookahead: Coordinate = AUTOMATIC,
        adaptive_lookahead: Annotated[float, Real(0.0, 100.0)] = 1.0,
        wait: bool = True,
    ) -> bool | FlightFuture:
        """Follow a path from the present position by pure pursuit.

        `path` has points (x, y, z), metres; the last one is reached within 0.5 m, and held. `speed`
        is in metres per second, less near the end. `lookahead` is a distance in metres, computed
        from the speed if negative; `adaptive_lookahead` is added per metre of distance from the
        path. A lookahead that is too short is an `InputError`.
        """
        command = PathCommand(
            self.body,
            checks.path(path),
            speed,
            timeout,
            yaw_control=YawControl(self.body, drivetrain, yaw_mode),
            lookahead=lookahead,
            adaptive=adaptive_lookahead,
            braking=braking_time(self.settings),
        )
        return self._run("move_along", command, wait)

    def move_to(
        self, x: float, y: float, z: float, speed: float = 1.0, timeout: Duration | None = None,
        **options: Unpack[PathOptions],
    ) -> bool | FlightFuture:  # fmt: skip
        """Fly to a position; see `move_along` for the options."""
        return self.move_along([(x, y, z)], speed, timeout, **options)

    def move_to_z(
        self,
        z: float,
        speed: float = 1.0,
        timeout: Duration | None = None,
        **options: Unpack[PathOptions],
    ) -> bool | FlightFuture:
        """Fly straight up or down to a height; see `move_along`."""
        x, y, _ = self.body.position[0].tolist()
        return self.move_along([(x, y, z)], speed, timeout, **options)

    @checked
    def rotate_to(
        self,
        yaw: Degrees,
        timeout: Duration | None = None,
        *,
        margin: Annotated[float, Real(0.0, 180.0, is_above=True)] = 5.0,
        wait: bool = True,
    ) -> bool | FlightFuture:
        """Turn to a heading the shorter way round, degrees to the right of the world's x axis.

        It fails after 20 s by default. `margin` is the heading error in degrees at which it
        succeeds, once the drone no longer turns.
        """
        limit = 20.0 if timeout is None else timeout
        *_, heading = to_simulator(0.0, 0.0, math.radians(yaw))
        command = RotateToCommand(self.body, heading, math.radians(margin), limit)
        return self._run("rotate_to", command, wait)

    @checked
    def rotate_by(
        self, rate: Degrees, duration: Duration, *, wait: bool = True
    ) -> bool | FlightFuture:
        """Turn at a rate, degrees per second to the right, for some seconds."""
        *_, turn = to_simulator(0.0, 0.0, math.radians(rate))
        return self._run("rotate_by", RotateByCommand(self.body, turn, duration), wait)

    @checked
    def move_by_manual(
        self,
        vx_max: Speed,
        vy_max: Speed,
        z_max: Annotated[float, Real(0.0)],
        duration: Duration,
        *,
        drivetrain: str = _FREE,
        yaw_mode: YawMode | None = None,
        wait: bool = True,
    ) -> bool | FlightFuture:
        """Follow `sticks`, which may change meanwhile.

        `vx_max` and `vy_max` are the speeds at full stick, forward in the heading at the start and
        sideways, m/s; `z_max` is the goal's height above the drone at full throttle, metres.
        """
        control = YawControl(self.body, drivetrain, yaw_mode)
        modes: Modes = (Mode.VELOCITY, Mode.VELOCITY, control.mode, Mode.POSITION)
        ahead = float(self.body.heading[0])
        cos, sin = math.cos(ahead), math.sin(ahead)

        def goals(body: FlightState) -> FlightGoals:
            sticks = Instance(Sticks).read(self.sticks, "sticks")
            forward, left = sticks.pitch * vx_max, -sticks.roll * vy_max
            x, y = cos * forward - sin * left, sin * forward + cos * left
            heading = control.goal(x, y) - math.radians(YAW_AT_FULL_STICK) * sticks.yaw
            z = max(0.0, float(body.position[0, 2]) + sticks.throttle * z_max)
            return goals_of(modes, x, y, heading, z)

        return self._run("move_by_manual", TimedCommand(goals, duration), wait)

    def _hold(
        self, name: str, goals: FlightGoals, duration: Duration, wait: bool
    ) -> bool | FlightFuture:
        """Keep the same goals for some seconds."""
        return self._run(name, TimedCommand(lambda body: goals, duration), wait)

    def _lift(self, z: float | None, throttle: float | None) -> tuple[Mode, float]:
        """Return the vertical goal and its mode; hold the present height by default.

        Raises:
            InputError: Both are given, or one is invalid.
        """
        if throttle is None:
            height = float(self.body.position[0, 2]) if z is None else z
            return Mode.POSITION, height
        if z is not None:
            raise InputError(f"z={z} and throttle={throttle} are both given; give one of them")
        return Mode.THROTTLE, throttle
