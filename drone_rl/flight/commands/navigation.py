"""Navigation (Table 3): by angle, by velocity, along a path, to a place, by hand."""

import math
from collections.abc import Sequence
from typing import Any

import torch

from drone_rl.flight.commands import checks
from drone_rl.flight.commands.along import AUTOMATIC, AlongPath, braking_time
from drone_rl.flight.commands.by_angle import ByAngle, ByRates, ByRotors, Height, Lift, Throttle
from drone_rl.flight.commands.by_velocity import ByVelocity, read_frame
from drone_rl.flight.commands.cockpit import Cockpit, limit_of, radians
from drone_rl.flight.commands.future import FlightFuture
from drone_rl.flight.commands.holding import RotateBy, RotateTo
from drone_rl.flight.commands.sticks import BySticks
from drone_rl.flight.commands.turning import Drivetrain, Turning, YawMode
from drone_rl.utils.errors import InputError

_FREE = Drivetrain.MAX_DEGREE_OF_FREEDOM


class Navigation(Cockpit):
    """The commands that take numbers; see `Pilot`."""

    def move_by_angle(
        self,
        roll: float,
        pitch: float,
        duration: float,
        *,
        z: float | None = None,
        throttle: float | None = None,
        yaw: float | None = None,
        yaw_rate: float | None = None,
        wait: bool = True,
    ) -> bool | FlightFuture:
        """Keeps roll and pitch.

        Args:
            roll: Degrees, right side down.
            pitch: Degrees, nose down: forward.
            duration: Seconds.
            z: Height to keep, metres; as it is by default.
            throttle: In place of `z`, share of all thrust from 0 to 1.
            yaw: To turn to, degrees to the left of the world's x; as it is by default.
            yaw_rate: In place of `yaw`, degrees a second to the left.
            wait: Whether time passes until it is over.

        Raises:
            InputError: Two are given of which one is enough, or a number can't be.
            PilotError: It isn't flying.
        """
        if yaw is not None and yaw_rate is not None:
            raise InputError(f"yaw={yaw} and yaw_rate={yaw_rate} are both given; give one of them")
        command = ByAngle(
            radians(roll, "roll", 90.0),
            radians(pitch, "pitch", 90.0),
            self._lift(z, throttle),
            checks.duration(duration),
            yaw=None if yaw is None else radians(yaw, "yaw"),
            yaw_rate=None if yaw_rate is None else radians(yaw_rate, "yaw_rate"),
        )
        return self._fly("move_by_angle", command, wait)

    def move_by_rates(
        self,
        roll: float,
        pitch: float,
        yaw: float,
        duration: float,
        *,
        z: float | None = None,
        throttle: float | None = None,
        wait: bool = True,
    ) -> bool | FlightFuture:
        """Keeps rates of turning, degrees a second about the drone's axes; see `move_by_angle`."""
        named = ((roll, "roll"), (pitch, "pitch"), (yaw, "yaw"))
        x, y, z_rate = (radians(value, name) for value, name in named)
        command = ByRates((x, y, z_rate), self._lift(z, throttle), checks.duration(duration))
        return self._fly("move_by_rates", command, wait)

    def move_by_rotors(
        self, shares: Sequence[float], duration: float, *, wait: bool = True
    ) -> bool | FlightFuture:
        """Sets all rotors: front right, rear left, front left, rear right, each from 0 to 1."""
        a, b, c, d = checks.numbers(shares, "shares", 4, 0.0, 1.0)
        command = ByRotors((a, b, c, d), checks.duration(duration))
        return self._fly("move_by_rotors", command, wait)

    def move_by_velocity(
        self,
        vx: float,
        vy: float,
        vz: float = 0.0,
        duration: float = 1.0,
        *,
        z: float | None = None,
        frame: str = "world",
        drivetrain: str = _FREE,
        yaw_mode: YawMode | None = None,
        wait: bool = True,
    ) -> bool | FlightFuture:
        """Keeps a velocity.

        Args:
            vx: Forward, metres a second.
            vy: To the left.
            vz: Up.
            duration: Seconds.
            z: Height to keep in place of `vz`, metres.
            frame: "world", or "body" where vx is ahead of the drone and vy to its left.
            drivetrain: See `Drivetrain`.
            yaw_mode: See `YawMode`.
            wait: Whether time passes until it is over.

        Raises:
            InputError: A number can't be, or drivetrain, yaw mode and frame don't go together.
            PilotError: It isn't flying.
        """
        x, y, up = (
            checks.real(v, n, -100.0, 100.0, unit="m/s")
            for v, n in ((vx, "vx"), (vy, "vy"), (vz, "vz"))
        )
        if z is not None and up != 0.0:
            raise InputError(f"z={z} and vz={up:g} are both given; give one of them")
        command = ByVelocity(
            (x, y),
            checks.duration(duration),
            climb=up,
            z=None if z is None else checks.height(z),
            frame=read_frame(frame),
            turning=Turning(drivetrain, yaw_mode),
        )
        return self._fly("move_by_velocity", command, wait)

    def move_along(
        self,
        path: Any,
        speed: float = 1.0,
        timeout: float | None = None,
        *,
        drivetrain: str = _FREE,
        yaw_mode: YawMode | None = None,
        lookahead: float = AUTOMATIC,
        adaptive_lookahead: float = 1.0,
        wait: bool = True,
    ) -> bool | FlightFuture:
        """Flies from where it is through points, after a carrot that runs ahead on the path.

        Args:
            path: Points (x, y, z), metres. The last one is reached within 0.5 m, and held.
            speed: Metres a second; less towards the end.
            timeout: Seconds after which it has failed; three times what it should take and 10 s by
                default.
            drivetrain: See `Drivetrain`.
            yaw_mode: See `YawMode`.
            lookahead: How far ahead the carrot is, metres; worked out of the speed if negative.
            adaptive_lookahead: How much of its distance from the path comes on top.
            wait: Whether time passes until it is over.

        Raises:
            InputError: The path has no points, a number can't be, the lookahead is too short, or
                drivetrain and yaw mode don't go together.
            PilotError: It isn't flying.
        """
        points, pace = checks.path(path), checks.speed(speed)
        whole = torch.cat([self._drone.body.position[:, None], points], 1)
        length = float(whole.diff(dim=1).norm(dim=-1).sum())
        command = AlongPath(
            points,
            pace,
            limit_of(timeout, length, pace),
            turning=Turning(drivetrain, yaw_mode),
            lookahead=checks.real(lookahead, "lookahead", unit="m"),
            adaptive=checks.real(adaptive_lookahead, "adaptive_lookahead", 0.0, 100.0),
            braking=braking_time(self.settings),
        )
        return self._fly("move_along", command, wait)

    def move_to(
        self, x: float, y: float, z: float, speed: float = 1.0, timeout: float | None = None,
        **choices: Any,
    ) -> bool | FlightFuture:  # fmt: skip
        """Flies to a place; see `move_along` for all that can be chosen."""
        return self.move_along([(x, y, z)], speed, timeout, **choices)

    def move_to_z(
        self, z: float, speed: float = 1.0, timeout: float | None = None, **choices: Any
    ) -> bool | FlightFuture:
        """Flies straight up or down to a height; see `move_along`."""
        x, y, _ = self._drone.body.position[0].tolist()
        return self.move_along([(x, y, z)], speed, timeout, **choices)

    def rotate_to(
        self, yaw: float, timeout: float | None = None, *, margin: float = 5.0, wait: bool = True
    ) -> bool | FlightFuture:
        """Turns to a heading, degrees to the left of the world's x, the shorter way round.

        Args:
            yaw: The heading.
            timeout: Seconds after which it has failed; 20 by default.
            margin: Degrees off at which it is done, once it no longer turns.
            wait: Whether time passes until it is over.
        """
        limit = 20.0 if timeout is None else checks.duration(timeout)
        near = math.radians(checks.real(margin, "margin", 0.0, 180.0, is_above=True))
        return self._fly("rotate_to", RotateTo(radians(yaw, "yaw"), near, limit), wait)

    def rotate_by(self, rate: float, duration: float, *, wait: bool = True) -> bool | FlightFuture:
        """Turns at a rate, degrees a second to the left, for some seconds."""
        command = RotateBy(radians(rate, "rate"), checks.duration(duration))
        return self._fly("rotate_by", command, wait)

    def move_by_manual(
        self,
        vx_max: float,
        vy_max: float,
        z_max: float,
        duration: float,
        *,
        drivetrain: str = _FREE,
        yaw_mode: YawMode | None = None,
        wait: bool = True,
    ) -> bool | FlightFuture:
        """Obeys `sticks`, which may be moved meanwhile.

        Args:
            vx_max: Speed ahead with the stick as far forward as it goes, metres a second.
            vy_max: The same to the side.
            z_max: How far above the drone its goal is with full throttle, metres.
            duration: Seconds.
            drivetrain: See `Drivetrain`.
            yaw_mode: See `YawMode`.
            wait: Whether time passes until it is over.
        """
        command = BySticks(
            lambda: self.sticks,
            checks.duration(duration),
            vx_max=checks.speed(vx_max, "vx_max"),
            vy_max=checks.speed(vy_max, "vy_max"),
            z_max=checks.height(z_max, "z_max"),
            turning=Turning(drivetrain, yaw_mode),
        )
        return self._fly("move_by_manual", command, wait)

    def _lift(self, z: float | None, throttle: float | None) -> Lift:
        """What holds it up.

        Raises:
            InputError: Height and throttle are both given, or one can't be.
        """
        if throttle is None:
            return Height(float(self._drone.body.position[0, 2]) if z is None else checks.height(z))
        if z is not None:
            raise InputError(f"z={z} and throttle={throttle} are both given; give one of them")
        return Throttle(checks.real(throttle, "throttle", 0.0, 1.0))
