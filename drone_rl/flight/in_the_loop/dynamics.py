"""A drone in the loop as the dynamics of a world, so that policies can fly it."""

import time

import numpy as np
from torch import Tensor

from drone_rl.config import ActionSettings, DynamicsSettings
from drone_rl.flight.in_the_loop.control import Setpoint, setpoint_of
from drone_rl.flight.in_the_loop.drone import (
    LONGEST_DECISION,
    STICKS_TICKS,
    DroneInTheLoop,
    FlightControllerError,
    NotReadyError,
)
from drone_rl.flight.in_the_loop.instruments import Readings
from drone_rl.flight.in_the_loop.trial_flight import hold_position, take_off
from drone_rl.sim.dynamics import BodyState, FlightState, Obstacles, Quadrotor
from drone_rl.sim.dynamics.state import SEED

NEAR, SLOW = 0.1, 0.1
"""Position error in metres, and speed in m/s, within which a drone hovers."""
_ARM_TRIES = 6
"""A firmware on a busy machine refuses the first attempts."""
_HOVER_WITHIN = 15.0
"""Seconds in which the drone must hover after take-off."""


class InTheLoopDynamics:
    """`Dynamics` of one world in which each step flies the drone in the loop for one action.

    Unlike other dynamics it holds a drone that has one flight only: `start` chooses where the
    episode begins, `begin` flies there, then each `step` continues.
    """

    stops_at_solids = False

    def __init__(
        self,
        drone: DroneInTheLoop,
        settings: DynamicsSettings,
        actions: ActionSettings | None = None,
    ) -> None:
        """Take a disarmed drone on the ground, the three moves as its actions by default.

        Only the duration of an action and the camera mount apply: the drone has its own vehicle.
        """
        self.drone = drone
        self.settings = settings
        self._quadrotor = Quadrotor(settings, actions)
        self.actions = self._quadrotor.actions
        self.mount, self.timestep = self._quadrotor.mount, self._quadrotor.timestep
        self.stride = self._quadrotor.stride
        self.is_random = self._quadrotor.is_random
        """As without the loop, so that the same worlds are sampled."""
        self.needs_obstacles = True
        self._last = 0.0

    def start(self, position: Tensor, seeds: Tensor | None = None) -> FlightState:
        """Return the start of an episode; the drone itself moves in `begin`."""
        return self._quadrotor.start(position, seeds)

    def begin(self, body: BodyState) -> None:
        """Arm the drone, take off and hover where the episode begins, at the state from `start`.

        Raises:
            NotReadyError: The drone doesn't arm or hover there, or the flight controller failed.
        """
        assert isinstance(body, FlightState)
        drone, place = self.drone, body.position[0].numpy()
        drone.body.numbers[:, SEED] = body.numbers[:, SEED]

        def hovers(readings: Readings) -> bool:
            off = np.linalg.norm(readings.position - place)
            return bool(off < NEAR and np.linalg.norm(readings.velocity) < SLOW)

        try:
            drone.arm(tries=_ARM_TRIES)
            take_off(drone, place)
            is_there = drone.fly(hold_position(place, drone.settings), _HOVER_WITHIN, until=hovers)
        except FlightControllerError as error:
            raise NotReadyError(str(error)) from error
        if not is_there:
            raise NotReadyError(f"the drone doesn't hover {_HOVER_WITHIN:g} s after its take-off")
        self._last = time.monotonic()

    def step(
        self, body: BodyState, action: Tensor, obstacles: Obstacles | None = None
    ) -> FlightState:
        """Fly for one action, shape (1, *); see `Dynamics`.

        Of `body` only the position and the reference count; `drone` has the state.

        Raises:
            FlightControllerError: See `DroneInTheLoop.tick`; or the policy took too long.
        """
        assert isinstance(body, FlightState)
        waited = time.monotonic() - self._last
        if waited > LONGEST_DECISION:
            raise FlightControllerError(
                f"the policy took {waited:.2f} s for an action, more than {LONGEST_DECISION:g} s; "
                "fly it on a machine that is less busy"
            )
        drone, goals = self.drone, self._quadrotor.steering.goals(body, action)
        begin = drone.time

        def track(_: BodyState, readings: Readings) -> Setpoint:
            return setpoint_of(goals, readings.time - begin, readings, drone.settings)

        drone.obstacles = obstacles
        seconds, every = self.settings.control_timestep, STICKS_TICKS * drone.settings.tick
        drone.fly(track, seconds, every=every)
        self._last = time.monotonic()
        after = FlightState(drone.body.numbers.clone())
        after.reference[:] = goals.reference_after(seconds, after)
        return after
