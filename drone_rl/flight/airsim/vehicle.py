"""A vehicle of the server: a pilot with AirSim's commands, units and permissions."""

import math
from collections.abc import Callable, Sequence
from typing import Any

from drone_rl.flight.airsim.airframe import Airframe
from drone_rl.flight.airsim.calls import remark
from drone_rl.flight.airsim.messages import ned, to_world
from drone_rl.flight.commands.command import FlightFuture, PilotError
from drone_rl.flight.commands.path_following import Drivetrain, YawMode
from drone_rl.sim.coordinates import GeoPoint

_DEGREES = 180.0 / math.pi


class Vehicle(Airframe):
    """One vehicle and its commands. Values are in NED, relative to the start position.

    Angles are in radians, except where a method says degrees.
    Movements return a `FlightFuture`, or False if API control is off: the movement is refused.
    """

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

    def _require_armed(self, name: str) -> None:
        """Raise a `PilotError` with the remedies of AirSim's clients."""
        if self.is_computer_vision:
            raise PilotError(
                f"{name} needs a vehicle with dynamics, but this one is in ComputerVision mode; "
                "use simSetVehiclePose"
            )
        if self._is_lost:
            raise PilotError("the simulation of this vehicle has diverged; call reset")
        if not self._is_armed:
            raise PilotError("this vehicle is not armed; call armDisarm(True)")

    def _moved(
        self, move: Callable[..., bool | FlightFuture], *args: Any, **kwargs: Any
    ) -> bool | FlightFuture:
        """Start a movement of `Pilot`, unless API control is off."""
        if not self.has_api_control:
            remark("ignored, because API control is off; call enableApiControl(True)")
            return False
        return move(*args, wait=False, **kwargs)

    def takeoff(self, timeout: float) -> bool | FlightFuture:
        """Climb 2 m; a `PilotError` if it moves."""
        return self._moved(self.take_off, timeout)

    def land_down(self, timeout: float) -> bool | FlightFuture:
        """Descend until it stands."""
        return self._moved(self.land, timeout)

    def return_home(self, timeout: float) -> bool | FlightFuture:
        """Fly over the start point and land there."""
        return self._moved(self.go_home, timeout)

    def hold(self) -> bool | FlightFuture:
        """Hold the position."""
        return self._moved(self.hover)

    def move_velocity(
        self,
        velocity: Sequence[float],
        seconds: float,
        drivetrain: str,
        yaw: YawMode,
        *,
        z: float | None = None,
        in_body: bool = False,
    ) -> bool | FlightFuture:
        """Hold a velocity in m/s, at the height of `z` if given.

        With `in_body` it is forward and to the right of the vehicle, else north and east.
        """
        vx, vy, vz = to_world(velocity)
        if in_body and drivetrain == Drivetrain.FORWARD_ONLY:
            vx, vy = self._turned(vx, vy)
            in_body = False
        return self._moved(
            self.move_by_velocity,
            *(vx, vy, vz if z is None else 0.0, seconds),
            z=self._height(z),
            frame="body" if in_body else "world",
            drivetrain=drivetrain,
            yaw_mode=yaw,
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
    ) -> bool | FlightFuture:
        """Follow a path of points in metres; `speed` in m/s, `timeout` in seconds.

        For `lookahead` and `adaptive` see `Pilot.move_along`.
        """
        return self._moved(
            self.move_along,
            [self._world(point) for point in points],
            *(speed, timeout),
            drivetrain=drivetrain,
            yaw_mode=yaw,
            lookahead=lookahead,
            adaptive_lookahead=adaptive,
        )

    def move_height(
        self, z: float, speed: float, timeout: float, yaw: YawMode, *lookahead: float
    ) -> bool | FlightFuture:
        """Fly straight up or down to `z`; see `move_path`."""
        x, y, _ = self.pose.position
        kind = Drivetrain.MAX_DEGREE_OF_FREEDOM
        return self.move_path([(x, y, z)], speed, timeout, kind, yaw, *lookahead)

    def move_geo(self, place: GeoPoint, *more: Any) -> bool | FlightFuture:
        """Fly to a place on Earth; for the other arguments see `move_path`."""
        return self.move_path([ned(self._from_geo(place) - self.home)], *more)

    def turn_to(self, degrees: float, timeout: float, margin: float) -> bool | FlightFuture:
        """Turn to a heading, degrees clockwise from north, within a margin in degrees."""
        heading = math.remainder(degrees, 360.0)
        near = min(max(margin, 0.1), 180.0)
        return self._moved(self.rotate_to, heading, timeout, margin=near)

    def turn_by(self, rate: float, seconds: float) -> bool | FlightFuture:
        """Turn at a rate, degrees per second clockwise."""
        return self._moved(self.rotate_by, rate, seconds)

    def tilt(
        self,
        seconds: float,
        *,
        roll: float,
        pitch: float,
        yaw: float | None = None,
        yaw_rate: float | None = None,
        z: float | None = None,
        throttle: float | None = None,
    ) -> bool | FlightFuture:
        """Hold roll and pitch, radians; and yaw, or else the yaw rate, radians (per second).

        The lift is the height of `z`, or else the throttle, from 0 to 1.
        """
        return self._moved(
            self.move_by_angle,
            *(roll * _DEGREES, pitch * _DEGREES, seconds),
            yaw=None if yaw is None else math.remainder(yaw * _DEGREES, 360.0),
            yaw_rate=None if yaw_rate is None else yaw_rate * _DEGREES,
            z=self._height(z),
            throttle=throttle,
        )

    def spin(
        self,
        seconds: float,
        *,
        roll_rate: float,
        pitch_rate: float,
        yaw_rate: float,
        z: float | None = None,
        throttle: float | None = None,
    ) -> bool | FlightFuture:
        """Hold roll, pitch and yaw rates, radians per second; for the lift see `tilt`."""
        degrees = (rate * _DEGREES for rate in (roll_rate, pitch_rate, yaw_rate))
        return self._moved(
            self.move_by_rates, *degrees, seconds, z=self._height(z), throttle=throttle
        )

    def set_rotors(
        self,
        seconds: float,
        *,
        front_right: float,
        rear_left: float,
        front_left: float,
        rear_right: float,
    ) -> bool | FlightFuture:
        """Set the rotors, each from 0 to 1."""
        shares = (front_right, rear_left, front_left, rear_right)
        return self._moved(self.move_by_rotors, shares, seconds)

    def move_manually(
        self, vx: float, vy: float, z: float, seconds: float, drivetrain: str, yaw: YawMode
    ) -> bool | FlightFuture:
        """Follow the sticks; `vx` and `vy` are the speeds at full stick, m/s.

        `-z` is the goal's height above the vehicle at full throttle.
        """
        return self._moved(
            self.move_by_manual,
            *(vx, vy, max(0.0, -z), seconds),
            drivetrain=drivetrain,
            yaw_mode=yaw,
        )

    def _turned(self, forward: float, left: float) -> tuple[float, float]:
        heading = float(self.body.heading[0])
        cos, sin = math.cos(heading), math.sin(heading)
        return cos * forward - sin * left, sin * forward + cos * left
