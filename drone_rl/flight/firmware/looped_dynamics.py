"""One drone that another's controller flies, as dynamics of a world like any other."""

import time

import numpy as np
from torch import Tensor

from drone_rl.config import ActionSettings, DynamicsSettings
from drone_rl.flight.firmware.course import HoldPilot, take_off
from drone_rl.flight.firmware.errors import LoopError, NotBegunError
from drone_rl.flight.firmware.flight import LONGEST_THOUGHT, STICKS_TICKS, LoopedDrone
from drone_rl.flight.firmware.senses import Senses
from drone_rl.flight.firmware.steered import told_after, wish_of
from drone_rl.flight.firmware.sticks import Wish
from drone_rl.sim.actions import Actions
from drone_rl.sim.dynamics import BodyState, Dynamics, FlightState, Goals, Obstacles, Quadrotor
from drone_rl.sim.dynamics.control import rotor_goals
from drone_rl.sim.dynamics.state import SEED

NEAR, SLOW = 0.1, 0.1
"""Metres from its place, and metres a second, within which a drone hovers."""
_TRIES = 6
"""At arming: a firmware on a busy machine refuses the first ones."""
_CALM_WITHIN = 15.0
"""Seconds in which it must."""


class LoopedDynamics(Dynamics):
    """Steps of one world, each of them a control step of the drone in the loop.

    Unlike other dynamics it holds a drone, and that drone has but one flight: `start` says where an
    episode is to begin, `begin` brings the drone there, then `step` must follow upon step.
    """

    def __init__(
        self,
        drone: LoopedDrone[FlightState],
        settings: DynamicsSettings,
        actions: ActionSettings | None = None,
    ) -> None:
        """Takes a drone over.

        Args:
            drone: Standing on the ground, not armed.
            settings: How long an action lasts and how cameras are mounted; else those of the drone.
            actions: What policies can tell it; the chapter's three moves by default.
        """
        self.drone = drone
        self.settings = settings
        self._quadrotor = Quadrotor(settings, actions)
        self._among = _Among(Quadrotor(drone.settings))
        self._last = 0.0

    @property
    def actions(self) -> Actions:
        """What policies can tell it."""
        return self._quadrotor.actions

    @property
    def mount(self) -> str:
        """See `DynamicsSettings.camera_mount`."""
        return self.settings.camera_mount

    @property
    def is_random(self) -> bool:
        """As in flight without the loop, so that the same worlds are drawn."""
        return self._quadrotor.is_random

    @property
    def needs_obstacles(self) -> bool:
        """What stands around is felt by the body."""
        return True

    def start(self, position: Tensor, seeds: Tensor | None = None) -> FlightState:
        """Where an episode is to begin; the drone itself is left where it is, see `begin`."""
        return self._quadrotor.start(position, seeds)

    def begin(self, body: BodyState) -> None:
        """Arms the drone, takes off and hovers where the episode is to begin.

        Args:
            body: From `start`; one drone.

        Raises:
            NotBegunError: It doesn't arm, or doesn't come to rest there.
        """
        assert isinstance(body, FlightState)
        drone, place = self.drone, body.position[0].numpy()
        drone.physics = self._among
        drone.body.numbers[:, SEED.first] = body.numbers[:, SEED.first]

        def hovers(senses: Senses) -> bool:
            off = np.linalg.norm(senses.position - place)
            return bool(off < NEAR and np.linalg.norm(senses.velocity) < SLOW)

        try:
            drone.arm(tries=_TRIES)
            take_off(drone, place)
        except LoopError as error:
            raise NotBegunError(str(error)) from error
        if not drone.fly(HoldPilot(place, drone.settings), _CALM_WITHIN, until=hovers):
            raise NotBegunError(f"the drone doesn't hover {_CALM_WITHIN:g} s after its take-off")
        self._last = time.monotonic()

    def step(
        self, body: BodyState, action: Tensor, obstacles: Obstacles | None = None
    ) -> FlightState:
        """The drone after a control step; see `Dynamics`.

        Args:
            body: From `start` or the last step; where it is wanted counts, the rest is the drone's.
            action: Of one world. Shape: (1, *).
            obstacles: What it may touch.

        Raises:
            LoopError: See `LoopedDrone.tick`; or the policy thought for too long.
        """
        assert isinstance(body, FlightState)
        thought = time.monotonic() - self._last
        if thought > LONGEST_THOUGHT:
            raise LoopError(
                f"the policy took {thought:.2f} s for an action, more than {LONGEST_THOUGHT:g} s; "
                "fly it on a machine that is less busy"
            )
        drone, goals = self.drone, self._quadrotor.steering.goals(body, action)
        self._among.obstacles = obstacles
        seconds, every = self.settings.control_timestep, STICKS_TICKS * drone.settings.tick
        drone.fly(_Told(goals, drone.time, drone.settings), seconds, every=every)
        self._last = time.monotonic()
        after = FlightState(drone.body.numbers.clone())
        after.reference[:] = told_after(goals, seconds, after)
        return after


class _Told:
    """A pilot who does what goals say."""

    def __init__(self, goals: Goals, begin: float, settings: DynamicsSettings) -> None:
        self._goals, self._begin, self._settings = goals, begin, settings

    def __call__(self, body: BodyState, senses: Senses) -> Wish:
        del body
        return wish_of(self._goals, senses.time - self._begin, senses, self._settings)


class _Among:
    """A drone whose rotors are commanded, among obstacles."""

    def __init__(self, quadrotor: Quadrotor) -> None:
        self._quadrotor = quadrotor
        self.obstacles: Obstacles | None = None

    def push(self, body: FlightState, rotors: Tensor, ticks: int) -> FlightState:
        return self._quadrotor.fly(body, rotor_goals(rotors), ticks, self.obstacles)
