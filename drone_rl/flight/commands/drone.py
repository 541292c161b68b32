"""A single drone as it stands on the ground or flies: rotors off, idle, or under goals."""

import math

import torch
from torch import Tensor

from drone_rl.flight.commands.batch import period_ticks
from drone_rl.flight.commands.command import hold
from drone_rl.flight.commands.sensing import Sensors
from drone_rl.flight.commands.state import (
    LandedState,
    PilotState,
    attitude_of,
    collision_of,
    triple,
)
from drone_rl.flight.commands.trajectory import Trajectory
from drone_rl.sim.dynamics import FlightState, Goals, Obstacles, Quadrotor
from drone_rl.sim.dynamics.control import rotor_goals
from drone_rl.sim.dynamics.state import CLIMB, NOTHING, TICKS

_IDLE = 0.1
"""Share of the thrust that carries the drone which rotors give while it stands, armed."""
_LEAST_THRUST = 0.1
"""Share of all thrust above which a drone that moves up or down is flying."""
_CLIMBS = 0.01
"""Metres a second that count as moving up or down."""
_AT_REST = 0.08
"""Metres, and radians, a second below which a drone on the ground has landed."""


class Drone:
    """Body, switches and clock. It knows no commands."""

    def __init__(self, quadrotor: Quadrotor, start: Tensor, heading: float, seed: int) -> None:
        """Puts a drone down, disarmed.

        Args:
            quadrotor: What it is.
            start: Where, metres: the middle of the drone. Shape: (3,), float64.
            heading: Radians to the left of the world's x.
            seed: Of its gusts.
        """
        self.quadrotor, self.home = quadrotor, start
        turned = [math.cos(0.5 * heading), 0.0, 0.0, math.sin(0.5 * heading)]
        attitude = torch.tensor([turned], dtype=torch.float64)
        self.body = FlightState.at_rest(start[None], attitude, torch.tensor([seed]))
        self.obstacles: Obstacles | None = None
        self.sensors: Sensors | None = None
        self.armed = False
        self.landed = LandedState.LANDED
        self.period = period_ticks(quadrotor.settings)
        self.trajectory = Trajectory()
        self.trajectory.note(self.time, self.body)

    @property
    def tick(self) -> float:
        """Seconds."""
        return self.quadrotor.settings.tick

    @property
    def time(self) -> float:
        """Simulated seconds."""
        return int(self.body.ticks[0]) * self.tick

    @property
    def speed(self) -> float:
        """Metres a second."""
        return float(self.body.velocity.norm())

    @property
    def is_flying(self) -> bool:
        """Whether nothing carries it."""
        return self.landed == LandedState.FLYING

    @property
    def is_lost(self) -> bool:
        """Whether its motion has diverged."""
        return bool(self.body.is_lost[0])

    @property
    def state(self) -> PilotState:
        """All that is known of it."""
        body = self.body
        w, x, y, z = body.attitude[0].tolist()
        return PilotState(
            time=self.time,
            position=triple(body.position),
            velocity=triple(body.velocity),
            attitude=attitude_of((w, x, y, z)),
            landed=self.landed,
            armed=self.armed,
            lost=self.is_lost,
            collision=collision_of(body),
        )

    def ticks_of(self, seconds: float) -> int:
        """As few ticks as take so long."""
        return math.ceil(seconds / self.tick - 1e-9)

    def fly(self, goals: Goals | None, ticks: int) -> None:
        """Lets time pass.

        Args:
            goals: What it is told; nothing by default: it stands with idle rotors.
            ticks: How long.
        """
        if not self.armed:
            goals = self._rotors(0.0)
        elif goals is None:
            goals = self._rotors(_IDLE * self.quadrotor.settings.hover_throttle)
        if not self.is_lost:
            self.body = self.quadrotor.fly(self.body, goals, ticks, self.obstacles)
        if self.is_lost:  # it stays where it was last seen
            self.body.numbers[:, TICKS.first] += ticks
        self.trajectory.note(self.time, self.body)
        if self.sensors is not None:
            self.sensors.update(self.body, ticks * self.tick)
        self._notice()

    def settle(self) -> None:
        """Lands for the controller: what it remembers of the last flight is forgotten."""
        self.landed = LandedState.LANDED
        self.body.numbers[:, CLIMB.first] = 2.0 * self.quadrotor.settings.hover_throttle - 1.0

    def here(self) -> Tensor:
        """The place where it is, as in `FlightState.reference`. Shape: (1, 4)."""
        return self.body.settled().reference.clone()

    def stay(self, reference: Tensor, ticks: int) -> None:
        """Lets time pass at a place."""
        self.fly(hold(reference), ticks)

    def _rotors(self, share: float) -> Goals:
        return rotor_goals(torch.full((1, 4), share, dtype=torch.float64))

    def _notice(self) -> None:
        """Sees whether it has taken off or come down."""
        body = self.body
        pushes = float(body.rotors.mean()) > _LEAST_THRUST
        if not self.is_flying:
            if pushes and abs(float(body.velocity[0, 2])) > _CLIMBS:
                self.landed = LandedState.FLYING
            return
        contact = body.contact
        touches = int(contact.thing[0]) != NOTHING
        touches = touches and float(contact.time[0]) > self.time - 2.5 * self.tick
        turns = float(body.angular_velocity.norm())
        if touches and not pushes and max(self.speed, turns) < _AT_REST:
            self.settle()
