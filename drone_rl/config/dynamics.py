"""Settings of how drones move: vehicle, controller, wind, and the actions of a policy.

Each file of conf/dynamics describes one drone by these settings.
"""

import math
from typing import Annotated

from drone_rl.config.values import Fraction
from drone_rl.utils.errors import InputError
from drone_rl.utils.models import Model
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


class DynamicsSettings(Settings):
    """A drone with four rotors, SimpleFlight's controller that flies it, and the air around it.

    The defaults are AirSim's generic X frame and its controller's gains. Body frame: x forward, y
    left, z up; triples are along, or about, these axes. In computer-vision mode (Table 1) actions
    set poses: only `mode` has an effect and, with `actions=velocity`, `control_ticks` and `tick`.
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
    """Density of the air in kg/m3; 0 for no drag (rotor thrust does not change)."""

    mass: Annotated[float, Real(0.0, 1000.0, is_above=True, unit="kg")] = 1.0
    """Mass in kilograms."""
    inertia: Annotated[Triple, Several(_Positive, 3, 3)] = (0.00672, 0.00804, 0.01428)
    """Moments of inertia about the body axes, in kg m2."""
    arm_length: Annotated[float, Real(0.0, 10.0, is_above=True, unit="m")] = 0.2275
    """Distance from the centre to each rotor, in metres; arms are at 45 degrees to x."""
    radius: Annotated[float, Real(0.0, 10.0, is_above=True, unit="m")] = 0.3
    """Radius of the sphere that collides with ground and obstacles, in metres; in scene files it is
    half of `task.drone_size`."""
    rotor_thrust: Annotated[float, Real(0.0, 10_000.0, is_above=True, unit="N")] = 4.179446268
    """Maximum thrust of one rotor, in newtons."""
    rotor_torque: Annotated[float, Real(0.0, 1000.0, is_above=True, unit="N m")] = 0.055562
    """Drag torque of one rotor at maximum thrust, in newton metres."""
    rotor_time_constant: Annotated[float, Real(0.0, 10.0, unit="s")] = 0.005
    """Time constant of a rotor's first-order response, in seconds; 0 for none."""
    drag_area: Annotated[Triple, Several(Real(0.0, 100.0), 3, 3)] = (0.00538, 0.00611, 0.02989)
    """Half the drag coefficient times the area that faces each axis, in square metres."""
    restitution: Fraction = 0.55
    """Coefficient of restitution of a contact."""
    friction: Annotated[float, Real(0.0, 10.0)] = 0.5
    """Coefficient of friction of a contact."""

    rate_gain: Gains = (0.25, 0.25, 0.25)
    """Gain of the rate controller: control per rad/s of error."""
    rate_limit: Gains = (2.5, 2.5, 2.5)
    """Limits of the attitude controller's rate commands, in rad/s."""
    angle_gain: Gains = (2.5, 2.5, 2.5)
    """Gain of the attitude controller: fractions of the rate limit per radian of error."""
    angle_limit: Annotated[float, Real(0.0, 1.5, is_above=True, unit="radians")] = math.pi / 5.5
    """Limit of the velocity controller's roll and pitch commands, in radians."""
    velocity_gain: Gain = 0.2
    """Gain of the velocity controller: fraction of the angle limit per m/s of error."""
    velocity_limit: Annotated[float, Real(0.0, 100.0, is_above=True, unit="m/s")] = 6.0
    """Limit of the position controller's horizontal velocity commands, in m/s."""
    climb_gain: Gain = 2.0
    """Gain of the climb controller: thrust (-1 to 1) per m/s of error."""
    climb_integral: Gain = 2.0
    """Integral gain of the climb controller."""
    climb_limit: Annotated[float, Real(0.0, 100.0, is_above=True, unit="m/s")] = 4.0
    """Limit of the position controller's climb rate commands, in m/s."""
    position_gain: Gain = 0.25
    """Gain of the position controller: fraction of the velocity limit per metre of error."""

    @property
    def is_computer_vision(self) -> bool:
        """Whether actions set poses."""
        return self.mode == MODES[0]

    def effective(self, actions: str) -> tuple[str, ...]:
        """Return the names of the settings that have an effect with a kind of actions."""
        if not self.is_computer_vision:
            return tuple(self.values())
        return ("mode", "control_ticks", "tick") if actions == "velocity" else ("mode",)

    @property
    def control_timestep(self) -> float:
        """Seconds from one action to the next."""
        return self.control_ticks * self.tick

    @property
    def hover_throttle(self) -> float:
        """Fraction of the maximum thrust that carries the drone."""
        return self.mass * GRAVITY / (4.0 * self.rotor_thrust)

    def check(self) -> None:
        """Refuse impossible inertia, and a thrust that is too small to control the drone."""
        largest, others = max(self.inertia), sum(self.inertia) - max(self.inertia)
        if largest > others * (1.0 + 1e-9):
            most = f"at most {0.999 * others:.4g}"
            self.refuse("inertia", f"is of no body: one exceeds the other two; give {most}")
        least = _HEADROOM * self.mass * GRAVITY / 4.0
        if self.rotor_thrust < least:
            remedy = f"give at least {1.001 * least:.4g}"
            self.refuse("rotor_thrust", f"can't carry and control mass={self.mass}; {remedy}")

    def check_air(self) -> None:
        """Raise an `InputError` for wind or gusts without effect, in computer-vision mode."""
        if self.is_computer_vision and (any(self.wind) or self.gusts):
            name, value = ("wind", list(self.wind)) if any(self.wind) else ("gusts", self.gusts)
            raise InputError(
                f"dynamics.{name}={value} moves nothing in computer-vision mode; give "
                'dynamics=quadrotor, too (in Python mode="simple_flight")'
            )


COMPUTER_VISION = DynamicsSettings()
"""Computer-vision mode, the default of files without dynamics."""


ACTION_KINDS = ("moves", "moves_3d", "moves_turning", "moves_full", "velocity")
Speed = Annotated[float, Real(0.0, 50.0, is_above=True, unit="m/s")]


class Axis(Model):
    """One of the independent quantities that an action sets."""

    name: str
    unit: str
    low: float
    high: float
    step: float | None = None
    """Distance of two values of a discrete axis; None if the axis is continuous."""


class ActionSettings(Settings):
    """Settings of the actions, one at each control step."""

    kind: Annotated[str, OneOf(ACTION_KINDS)] = "moves"
    """Discrete moves of equal length along the drone's heading: moves (forward, left, right),
    moves_3d (also up and down), moves_turning (forward and turns to both sides) or moves_full (all
    of them, and back); or velocity: forward speed, lateral speed, yaw rate and, with `climb_speed`,
    climb rate, all continuous."""
    move_speed: Speed = 4.0
    """Speed of the position setpoint during a move, in m/s; in computer-vision mode a move is the
    task's step."""
    move_lead: Annotated[float, Real(0.01, 100.0, unit="m")] = 0.5
    """Largest distance along x and along y, and along z if there are moves up, from the drone to
    the position setpoint at the start of a move, in metres."""
    turn_step: Annotated[float, Real(0.1, 180.0, unit="degrees")] = 15.0
    """Angle of a discrete turn in computer-vision mode, in degrees; a drone with dynamics turns at
    `yaw_rate`."""
    forward_speed: Speed = 4.0
    """Largest forward speed command, in m/s."""
    sideways_speed: Speed = 3.0
    """Largest lateral speed command, in m/s."""
    yaw_rate: Annotated[float, Real(0.0, 720.0, unit="degrees/s")] = 45.0
    """Largest yaw rate command, in degrees/s; 0 for none. Also the yaw rate of discrete turns."""
    climb_speed: Annotated[float, Real(0.0, 50.0, unit="m/s")] = 0.0
    """Largest climb and sink rate command, in m/s; 0 for none, which keeps the height."""
    backward_speed: Annotated[float, Real(0.0, 50.0, unit="m/s")] = 0.0
    """Largest backward speed command, in m/s; 0 for none."""

    @property
    def axes(self) -> tuple[Axis, ...]:
        """The axes; discrete actions move along one of them at a time."""
        if self.kind == "velocity":
            most = {"left": self.sideways_speed, "turn left": self.yaw_rate}
            if self.climb_speed:
                most["up"] = self.climb_speed
            back = 0.0 - self.backward_speed
            return (
                Axis(name="forward", unit="m/s", low=back, high=self.forward_speed),
                *(
                    Axis(name=n, unit="degrees/s" if "turn" in n else "m/s", low=-high, high=high)
                    for n, high in most.items()
                ),
            )
        names = {
            "moves": ("forward", "left"),
            "moves_3d": ("forward", "left", "up"),
            "moves_turning": ("forward", "turn left"),
            "moves_full": ("forward", "left", "up", "turn left"),
        }[self.kind]
        return tuple(
            Axis(
                name=name,
                unit="turns" if name == "turn left" else "moves",
                low=0.0 if name == "forward" and self.kind != "moves_full" else -1.0,
                high=1.0,
                step=1.0,
            )
            for name in names
        )

    @property
    def has_turns(self) -> bool:
        """Whether there are discrete turns."""
        return self.kind in ("moves_turning", "moves_full")

    def check(self) -> None:
        """Refuse turns that a drone with dynamics would not make."""
        if self.has_turns and not self.yaw_rate:
            self.refuse(
                "yaw_rate", f"is none for the turns of actions={self.kind}; give more than 0"
            )


MOVES_SETTINGS = ActionSettings()
"""The default actions: three moves."""
