"""Settings of how drones move: vehicle, controller, wind, and the actions of a policy.

A drone is data: another drone is another file of these values.
"""

import dataclasses
import math
from typing import Annotated

from drone_rl.utils.errors import InputError
from drone_rl.utils.schema import OneOf, Real, Several, Whole
from drone_rl.utils.settings import Settings

MODES = ("computer_vision", "simple_flight")
MOUNTS = ("gimbal", "body")
GRAVITY = 9.81
"""Metres a second squared."""
_HEADROOM = 1.1
"""Thrust over weight below which a drone can't climb, brake or turn."""

Triple = tuple[float, float, float]
_Positive = Real(0.0, 1e6, is_above=True)
Gain = Annotated[float, Real(0.0, 1000.0)]
Gains = Annotated[Triple, Several(Real(0.0, 1000.0), 3, 3)]


@dataclasses.dataclass(frozen=True, kw_only=True)
class DynamicsSettings(Settings):
    """A drone with four rotors, SimpleFlight's controller that flies it, and the air around it.

    The defaults are AirSim's generic X frame and its controller's gains. Body frame: x forward, y
    left, z up; triples are along, or about, these axes. In computer-vision mode (Table 1) none but
    the mode counts: there, actions set poses.

    Raises:
        InputError: A value is out of range, or no such drone could fly.
    """

    mode: Annotated[str, OneOf(MODES)] = "computer_vision"
    """computer_vision, where actions set poses, or simple_flight (Table 1)."""
    camera_mount: Annotated[str, OneOf(MOUNTS)] = "gimbal"
    """gimbal, which keeps cameras level and turns them with the drone's heading, or body."""
    control_ticks: Annotated[int, Whole(1, 10_000, "ticks")] = 33
    """Ticks of physics from one action to the next."""
    tick: Annotated[float, Real(0.0001, 0.02, unit="s")] = 0.003
    """Length of a tick of physics and controller, in seconds."""

    wind: Annotated[Triple, Several(Real(-50.0, 50.0, unit="m/s"), 3, 3)] = (0.0, 0.0, 0.0)
    """Mean velocity of the air, in metres a second, world frame."""
    gusts: Annotated[float, Real(0.0, 20.0, unit="m/s")] = 0.0
    """Standard deviation of the air's velocity along each axis, in metres a second."""
    gust_length: Annotated[float, Real(0.1, 10_000.0, unit="m")] = 50.0
    """Length scale of gusts (Dryden's), in metres."""
    air_density: Annotated[float, Real(0.0, 100.0, unit="kg/m3")] = 1.225
    """In kilograms a cubic metre; 0 for none: rotors push as hard without, but nothing drags."""

    mass: Annotated[float, Real(0.0, 1000.0, is_above=True, unit="kg")] = 1.0
    """In kilograms."""
    inertia: Annotated[Triple, Several(_Positive, 3, 3)] = (0.00672, 0.00804, 0.01428)
    """Moments about the body's axes, in kilograms times square metres."""
    arm_length: Annotated[float, Real(0.0, 10.0, is_above=True, unit="m")] = 0.2275
    """From the middle to each rotor, in metres; arms stand at 45 degrees to x."""
    radius: Annotated[float, Real(0.0, 10.0, is_above=True, unit="m")] = 0.3
    """Of the ball that touches ground and obstacles, in metres."""
    rotor_thrust: Annotated[float, Real(0.0, 10_000.0, is_above=True, unit="N")] = 4.179446268
    """The most that one rotor gives, in newtons."""
    rotor_torque: Annotated[float, Real(0.0, 1000.0, is_above=True, unit="N m")] = 0.055562
    """That the air puts on one rotor then, in newton metres."""
    rotor_time_constant: Annotated[float, Real(0.0, 10.0, unit="s")] = 0.005
    """Of a rotor's first-order answer, in seconds; 0 for none."""
    drag_area: Annotated[Triple, Several(Real(0.0, 100.0), 3, 3)] = (0.00538, 0.00611, 0.02989)
    """Half the drag coefficient times the area that faces each axis, in square metres."""
    restitution: Annotated[float, Real(0.0, 1.0)] = 0.55
    """Share of the speed into a contact that comes back."""
    friction: Annotated[float, Real(0.0, 10.0)] = 0.5
    """Of a contact, over its normal force."""

    rate_gain: Gains = (0.25, 0.25, 0.25)
    """Control of roll, pitch and yaw for each radian a second that is missing."""
    rate_limit: Gains = (2.5, 2.5, 2.5)
    """The greatest rates that the attitude controller asks for, in radians a second."""
    angle_gain: Gains = (2.5, 2.5, 2.5)
    """Shares of the greatest rate for each radian that is missing."""
    angle_limit: Annotated[float, Real(0.0, 1.5, is_above=True, unit="radians")] = math.pi / 5.5
    """The greatest roll and pitch that the velocity controller asks for, in radians."""
    velocity_gain: Gain = 0.2
    """Shares of the greatest angle for each metre a second that is missing."""
    velocity_limit: Annotated[float, Real(0.0, 100.0, is_above=True, unit="m/s")] = 6.0
    """The greatest horizontal speed that the position controller asks for, in metres a second."""
    climb_gain: Gain = 2.0
    """Control of thrust (-1 for none, 1 for all) for each metre a second of climb missing."""
    climb_integral: Gain = 2.0
    """The same for each metre a second, second after second."""
    climb_limit: Annotated[float, Real(0.0, 100.0, is_above=True, unit="m/s")] = 4.0
    """The greatest rate of climb and descent that the position controller asks for."""
    position_gain: Gain = 0.25
    """Shares of the greatest speed for each metre that is missing."""

    @property
    def is_computer_vision(self) -> bool:
        """Whether actions set poses."""
        return self.mode == MODES[0]

    @property
    def control_timestep(self) -> float:
        """Seconds from one action to the next."""
        return self.control_ticks * self.tick

    @property
    def hover_throttle(self) -> float:
        """Share of all thrust that carries the drone."""
        return self.mass * GRAVITY / (4.0 * self.rotor_thrust)

    def check(self) -> None:
        """Refuses bodies that nothing can have, and drones that can't fly."""
        largest, others = max(self.inertia), sum(self.inertia) - max(self.inertia)
        if largest > others * (1.0 + 1e-9):
            raise InputError(
                f"inertia={list(self.inertia)} is that of no body: {largest:g} is more than the "
                f"other two together; give at most {others:g}"
            )
        weight, most = self.mass * GRAVITY, 4.0 * self.rotor_thrust
        if most < _HEADROOM * weight:
            raise InputError(
                f"rotor_thrust={self.rotor_thrust:g} can't hover: four rotors push {most:.3g} N "
                f"and the drone weighs {weight:.3g} N; give at least "
                f"{_HEADROOM * weight / 4:.3g}"
            )

    def check_air(self) -> None:
        """Refuses moving air where nothing feels it: whoever asks for both has forgotten the mode.

        Raises:
            InputError: There is wind, or there are gusts, in computer-vision mode.
        """
        if self.is_computer_vision and (any(self.wind) or self.gusts):
            name, value = ("wind", list(self.wind)) if any(self.wind) else ("gusts", self.gusts)
            raise InputError(
                f"dynamics.{name}={value} moves nothing in computer-vision mode; give "
                "dynamics.mode=simple_flight, too"
            )


COMPUTER_VISION = DynamicsSettings()
"""Actions set poses: what files mean that say nothing else."""


ACTION_KINDS = ("moves", "velocity")
Speed = Annotated[float, Real(0.0, 50.0, is_above=True, unit="m/s")]


@dataclasses.dataclass(frozen=True, kw_only=True)
class ActionSettings(Settings):
    """The actions between which a policy chooses, one at each control step.

    Raises:
        InputError: A value is out of range.
    """

    kind: Annotated[str, OneOf(ACTION_KINDS)] = "moves"
    """moves, the chapter's three of equal length without turning, or velocity: forward speed, speed
    to the left and yaw rate, any of these at once."""
    move_speed: Speed = 4.0
    """At which a move in flight shifts the place where the drone is wanted, in metres a second; in
    computer-vision mode a move is the task's step."""
    move_lead: Annotated[float, Real(0.01, 100.0, unit="m")] = 0.5
    """How far ahead of the drone that place may be, in metres."""
    forward_speed: Speed = 4.0
    """The greatest speed forward that can be asked for, in metres a second; none is backward."""
    sideways_speed: Speed = 3.0
    """The greatest speed to either side, in metres a second."""
    yaw_rate: Annotated[float, Real(0.0, 720.0, unit="degrees/s")] = 45.0
    """The greatest rate of turning to either side, in degrees a second; 0 for none."""

    @property
    def is_first(self) -> bool:
        """Whether these are the actions of files that name none."""
        return self == MOVES_SETTINGS


MOVES_SETTINGS = ActionSettings()
"""The chapter's three moves."""
