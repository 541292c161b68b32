"""A simulated drone flown by an external flight controller, in lockstep."""

import dataclasses
import time
from collections.abc import Callable
from typing import Protocol

import numpy as np
import torch

from drone_rl.config import DynamicsSettings
from drone_rl.flight.in_the_loop.control import AT_REST, RcSticks, Setpoint, sticks_for
from drone_rl.flight.in_the_loop.instruments import Readings, Vector, measure
from drone_rl.sim.dynamics import FlightState, Obstacles, Quadrotor
from drone_rl.sim.dynamics.control import rotor_goals

TICK = 0.001
"""Physics time step for Betaflight, seconds; the firmware runs at 1 kHz."""
SETPOINT_PERIOD = 0.02
"""Default period of setpoints, seconds."""
STICKS_TICKS = 10
"""Ticks between stick updates."""
LONGEST_DECISION = 0.2
"""Wall-clock seconds after which the firmware's failsafe would take over from a silent pilot."""


class FlightControllerError(RuntimeError):
    """A flight controller stopped, fell silent or refused a command."""


class NotReadyError(FlightControllerError):
    """A flight controller did not bring the drone to the start of an episode."""


class Controller(Protocol):
    """A flight controller, such as `Betaflight`."""

    def step(self, readings: Readings, sticks: RcSticks) -> Vector:
        """Return thrust fractions: front right, rear left, front left, rear right. Shape: (4,)."""
        ...


Guidance = Callable[[FlightState, Readings], Setpoint]
"""Returns the next setpoint, from the drone's state and measurements: a policy or a path."""


class DroneInTheLoop:
    """One simulated drone with an external flight controller."""

    def __init__(
        self,
        physics: Quadrotor,
        body: FlightState,
        controller: Controller,
        settings: DynamicsSettings,
    ) -> None:
        """Take the dynamics, the state of one drone at rest, its controller, and its settings.

        The settings are the vehicle's, whose tick is the time step, and the gains of the outer
        loops. Betaflight needs `tick=TICK`.
        """
        self.physics = physics
        self.obstacles: Obstacles | None = None
        """Obstacles to collide with."""
        self.body = body
        self.controller = controller
        self.settings = settings
        self.readings = measure(body, body, settings.tick, 0.0)
        self.rotors: Vector = np.zeros(4)
        """The controller's last thrust fractions, in the order of `Controller.step`."""
        self.trace: list[Readings] = []
        """The measurements at each setpoint."""
        self._ticks = 0
        self._integral = 0.0

    @property
    def time(self) -> float:
        """Simulated seconds."""
        return self._ticks * self.settings.tick

    def tick(self, sticks: RcSticks) -> None:
        """Step the controller and the physics once.

        Raises:
            FlightControllerError: The simulation has diverged, or the controller failed.
        """
        self.rotors = self.controller.step(self.readings, sticks)
        before = self.body
        goals = rotor_goals(torch.from_numpy(self.rotors)[None])
        self.body = self.physics.fly(before, goals, 1, self.obstacles)
        self._ticks += 1
        pose = torch.cat([self.body.position[0], self.body.attitude[0]])
        if bool(self.body.is_lost[0]) or not bool(pose.isfinite().all()):
            raise FlightControllerError(f"the drone's motion diverged after {self.time:.3g} s")
        self.readings = measure(before, self.body, self.settings.tick, self.time)

    def hold(self, sticks: RcSticks, seconds: float) -> None:
        """Advance with constant sticks."""
        for _ in range(round(seconds / self.settings.tick)):
            self.tick(sticks)

    def arm(self, tries: int = 3, settle: float = 3.5, within: float = 1.0) -> None:
        """Arm the firmware: throttle low, the switch first off, then on, until the rotors turn.

        The firmware calibrates its sensors for `settle` seconds. In each attempt the rotors must
        turn within some seconds, else a `FlightControllerError` is raised.
        """
        self._integral = 0.0
        self.hold(AT_REST, settle)
        for _ in range(tries):
            for _ in range(round(within / self.settings.tick)):
                self.tick(dataclasses.replace(AT_REST, armed=True))
                if self.rotors.min() > 0.0:
                    return
            self.hold(AT_REST, 0.5)
        raise FlightControllerError(
            f"the firmware refuses to arm: not all rotors turned in {tries} attempts"
        )

    def disarm(self, seconds: float = 0.5) -> None:
        """Hold the throttle low and the switch off for a while."""
        self.hold(AT_REST, seconds)

    def fly(
        self,
        guidance: Guidance,
        seconds: float,
        *,
        every: float = SETPOINT_PERIOD,
        until: Callable[[Readings], bool] = lambda readings: False,
    ) -> bool:
        """Fly by setpoints for so many seconds at most; return whether `until` ended the flight.

        The guidance is called at once and then every `every` seconds; `until` is called before each
        call and at the end.

        Raises:
            FlightControllerError: See `tick`; or the guidance took longer than the firmware's
                failsafe allows.
        """
        tick, between = self.settings.tick, max(1, round(every / self.settings.tick))
        setpoint, sticks = Setpoint((0.0, 0.0, 0.0)), AT_REST
        for count in range(round(seconds / tick)):
            if count % between == 0:
                if until(self.readings):
                    return True
                setpoint = self._timed(guidance)
                self.trace.append(self.readings)
            if count % STICKS_TICKS == 0:
                sticks, self._integral = sticks_for(
                    setpoint, self.readings, self._integral, STICKS_TICKS * tick, self.settings
                )
            self.tick(sticks)
        return until(self.readings)

    def _timed(self, guidance: Guidance) -> Setpoint:
        """Return the setpoint; raise if that took too long."""
        begin = time.monotonic()
        setpoint = guidance(self.body, self.readings)
        seconds = time.monotonic() - begin
        if seconds > LONGEST_DECISION:
            raise FlightControllerError(
                f"the setpoint took {seconds:.2f} s, more than {LONGEST_DECISION:g} s; "
                "call the function once before the flight, to compile its kernels"
            )
        return setpoint
