"""A vehicle of the server: a pilot with AirSim's commands, units and permissions."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from drone_rl.flight.airsim import messages
from drone_rl.flight.airsim.airframe import Airframe
from drone_rl.flight.airsim.messages import ned, to_world
from drone_rl.flight.commands.command import Command, FlightFuture, PilotError
from drone_rl.flight.commands.path_following import Drivetrain, YawMode
from drone_rl.flight.commands.pilot import MOVING, Sticks, speed_of
from drone_rl.sim.coordinates import GeoPoint
from drone_rl.utils.errors import InputError

LONGEST = 1e6
"""Longest timeout or duration in seconds; clients send up to 3e38."""
_DEGREES = 180.0 / math.pi


class Vehicle(Airframe):
    """One vehicle and its commands. Values are in NED, relative to the start position.

    Angles are in radians, except where a method says degrees.
    Movements return a `FlightFuture`, or None if API control is off: the movement is refused.
    """

    def allow(self, enable: bool) -> None:
        """Enable API control, or disable it and hover."""
        self.enable_api_control(enable)

    def set_armed(self, arm: bool) -> bool:
        """Arm or disarm; return whether it is in that state, False if API control is off.

        A vehicle that falls can't be armed. Without dynamics there is nothing to arm.
        """
        if not self.has_api_control or self.is_computer_vision:
            return self.has_api_control
        if not arm:
            self.disarm(force=True)
        elif not self._is_flying:
            self.arm()
        return self._is_armed == arm

    def _require_flight(self, method: str) -> None:
        if self.is_computer_vision:
            raise PilotError(
                f"{method} needs a vehicle with dynamics, but this one is in ComputerVision mode; "
                "use simSetVehiclePose"
            )

    def _require_armed(self, name: str) -> None:
        """Raise a `PilotError` with the remedies of AirSim's clients."""
        if self._is_lost:
            raise PilotError("the simulation of this vehicle has diverged; call reset")
        if not self._is_armed:
            raise PilotError("this vehicle is not armed; call armDisarm(True)")

    def _run(self, name: str, command: Command, wait: bool) -> bool | FlightFuture:
        """See `Drone`; as in AirSim a drone on the ground takes off by any movement."""
        self._require_armed(name)
        return self._start(name, command, wait)

    def _moved(self, name: str, *args: Any, **kwargs: Any) -> FlightFuture | None:
        """Start a movement of `Pilot`, unless API control is off."""
        self._require_flight("a movement")
        if not self.has_api_control:
            return None
        future = getattr(self, name)(*args, wait=False, **kwargs)
        assert isinstance(future, FlightFuture)
        return future

    def takeoff(self, timeout: float) -> FlightFuture | None:
        """Climb 2 m; a `PilotError` if it moves."""
        self._require_flight("takeoff")
        speed = speed_of(self.body)
        if speed > MOVING:
            raise PilotError(
                "Cannot perform takeoff because vehicle is already moving with velocity "
                f"{speed:f} m/s"
            )
        return self._moved("take_off", limit(timeout))

    def land_down(self, timeout: float) -> FlightFuture | None:
        """Descend until it stands."""
        return self._moved("land", limit(timeout))

    def return_home(self, timeout: float) -> FlightFuture | None:
        """Fly over the start point and land there."""
        return self._moved("go_home", limit(timeout))

    def hold(self) -> FlightFuture | None:
        """Hold the position."""
        return self._moved("hover")

    def move_velocity(
        self,
        velocity: Sequence[float],
        seconds: float,
        drivetrain: str,
        yaw: YawMode,
        *,
        z: float | None = None,
        in_body: bool = False,
    ) -> FlightFuture | None:
        """Hold a velocity in m/s, at the height of `z` if given.

        With `in_body` it is forward and to the right of the vehicle, else north and east.
        """
        vx, vy, vz = to_world(velocity)
        at: dict[str, Any] = {} if z is None else {"z": self._height(z)}
        climb = vz if z is None else 0.0
        if in_body and drivetrain == Drivetrain.FORWARD_ONLY:
            vx, vy = self._turned(vx, vy)
            in_body = False
        return self._moved(
            "move_by_velocity",
            *(vx, vy, climb, seconds),
            frame="body" if in_body else "world",
            drivetrain=drivetrain,
            yaw_mode=yaw,
            **at,
        )

    def move_path(
        self,
        points: Sequence[Sequence[float]],
        speed: float,
        timeout: float,
        drivetrain: str,
        yaw: YawMode,
        lookahead: float,
        adaptive: float,
    ) -> FlightFuture | None:
        """Follow a path of points in metres; `speed` in m/s, `timeout` in seconds.

        For `lookahead` and `adaptive` see `Pilot.move_along`.
        """
        if lookahead == 0.0:
            raise InputError("lookahead distance cannot be 0; give a distance, or -1 for its own")
        return self._moved(
            "move_along",
            [self._world(point) for point in points],
            *(speed, limit(timeout)),
            drivetrain=drivetrain,
            yaw_mode=yaw,
            lookahead=lookahead,
            adaptive_lookahead=max(0.0, adaptive),
        )

    def move_height(
        self,
        z: float,
        speed: float,
        timeout: float,
        yaw: YawMode,
        lookahead: float,
        adaptive: float,
    ) -> FlightFuture | None:
        """Fly straight up or down to `z`; see `move_path`."""
        x, y, _ = self._relative(self.body)
        kind = Drivetrain.MAX_DEGREE_OF_FREEDOM
        return self.move_path([(x, y, z)], speed, timeout, kind, yaw, lookahead, adaptive)

    def move_geo(
        self,
        place: GeoPoint,
        speed: float,
        timeout: float,
        drivetrain: str,
        yaw: YawMode,
        lookahead: float,
        adaptive: float,
    ) -> FlightFuture | None:
        """Fly to a place on Earth; see `move_path`."""
        target = ned((self._from_geo(place) - self.home)[None])
        return self.move_path([target], speed, timeout, drivetrain, yaw, lookahead, adaptive)

    def turn_to(self, degrees: float, timeout: float, margin: float) -> FlightFuture | None:
        """Turn to a heading, degrees clockwise from north, within a margin in degrees."""
        heading = math.remainder(degrees, 360.0)
        near = min(max(margin, 0.1), 180.0)
        return self._moved("rotate_to", heading, limit(timeout), margin=near)

    def turn_by(self, rate: float, seconds: float) -> FlightFuture | None:
        """Turn at a rate, degrees per second clockwise."""
        return self._moved("rotate_by", rate, seconds)

    def tilt(
        self,
        roll: float,
        pitch: float,
        seconds: float,
        *,
        yaw: float | None = None,
        yaw_rate: float | None = None,
        z: float | None = None,
        throttle: float | None = None,
    ) -> FlightFuture | None:
        """Hold roll and pitch, radians; and yaw, or else the yaw rate, radians (per second).

        The lift is the height of `z`, or else the throttle, from 0 to 1.
        """
        turn: dict[str, Any] = {}
        if yaw is not None:
            turn["yaw"] = math.remainder(yaw * _DEGREES, 360.0)
        if yaw_rate is not None:
            turn["yaw_rate"] = yaw_rate * _DEGREES
        lift = {"z": self._height(z)} if z is not None else {"throttle": throttle}
        return self._moved(
            "move_by_angle", roll * _DEGREES, pitch * _DEGREES, seconds, **turn, **lift
        )

    def spin(
        self,
        rates: Sequence[float],
        seconds: float,
        *,
        z: float | None = None,
        throttle: float | None = None,
    ) -> FlightFuture | None:
        """Hold roll, pitch and yaw rates, radians per second; for the lift see `tilt`."""
        lift = {"z": self._height(z)} if z is not None else {"throttle": throttle}
        degrees = [rate * _DEGREES for rate in rates]
        return self._moved("move_by_rates", *degrees, seconds, **lift)

    def set_rotors(self, shares: Sequence[float], seconds: float) -> FlightFuture | None:
        """Set the rotors, each from 0 to 1: front right, rear left, front left, rear right."""
        return self._moved("move_by_rotors", shares, seconds)

    def move_manually(
        self, vx: float, vy: float, z: float, seconds: float, drivetrain: str, yaw: YawMode
    ) -> FlightFuture | None:
        """Follow the sticks; `vx` and `vy` are the speeds at full stick, m/s.

        `-z` is the goal's height above the vehicle at full throttle.
        """
        return self._moved(
            "move_by_manual",
            *(vx, vy, max(0.0, -z), seconds),
            drivetrain=drivetrain,
            yaw_mode=yaw,
        )

    def set_sticks(self, of: Mapping[str, Any]) -> None:
        """Take the sticks of RCData, each from -1 to 1."""
        names = ("pitch", "roll", "throttle", "yaw")
        keyed = {key.decode() if isinstance(key, bytes) else key: v for key, v in of.items()}
        given = ((name, keyed.get(name, 0.0)) for name in names)
        values = (messages.number(value, f"rcdata.{name}", -1.0, 1.0) for name, value in given)
        self.sticks = Sticks(*values)

    def _turned(self, forward: float, left: float) -> tuple[float, float]:
        heading = float(self.body.heading[0])
        cos, sin = math.cos(heading), math.sin(heading)
        return cos * forward - sin * left, sin * forward + cos * left


def limit(seconds: float) -> float:
    """Return a timeout or duration that a pilot accepts; a negative one becomes 0."""
    return min(max(seconds, 0.0), LONGEST)
