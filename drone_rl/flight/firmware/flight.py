"""A drone of ours that another's controller flies: physics, instruments, pilot, in lockstep."""

import dataclasses
import time
from collections.abc import Callable
from typing import Generic, Protocol, TypeVar

import numpy as np
import torch
from torch import Tensor

from drone_rl.config import DynamicsSettings
from drone_rl.flight.firmware.errors import LoopError
from drone_rl.flight.firmware.senses import Senses, Vector, sense
from drone_rl.flight.firmware.sticks import AT_REST, Climb, Sticks, Wish, sticks_for
from drone_rl.sim.coordinates import HOME, GeoPoint
from drone_rl.sim.dynamics import BodyState

TICK = 0.001
"""Seconds of physics between two answers of a firmware: it steps a thousand times a second."""
PILOT_EVERY = 0.02
"""Seconds from one wish of a pilot to the next, unless told otherwise."""
STICKS_TICKS = 10
"""Ticks from one position of the sticks to the next."""
LONGEST_THOUGHT = 0.2
"""Seconds on the clock on the wall after which a firmware takes a silent pilot for lost."""


B = TypeVar("B", bound=BodyState)


class Pushed(Protocol[B]):
    """A body with rotors that somebody else commands, such as `Quadrotor`."""

    def push(self, body: B, rotors: Tensor, ticks: int) -> B:
        """The body some ticks later, its rotors told what to do. Shape of rotors: (1, 4)."""
        ...


class Controller(Protocol):
    """Who tells rotors what to do, such as `Betaflight`."""

    def step(self, senses: Senses, sticks: Sticks) -> Vector:
        """Shares of the rotors' most thrust: front right, rear left, front left, rear right."""
        ...


Pilot = Callable[[B, Senses], Wish]
"""Says where to go next, as a person, a policy or a path would: from the drone's state, and what it
senses, to a velocity and a heading that hold until it is asked again."""


@dataclasses.dataclass(frozen=True)
class Moment:
    """What is remembered of a flight, at each wish."""

    time: float
    """Seconds."""
    position: Vector
    """Metres, world frame. Shape: (3,)."""
    velocity: Vector
    """Metres a second, world frame. Shape: (3,)."""
    rotors: Vector
    """What they were told. Shape: (4,)."""


class LoopedDrone(Generic[B]):
    """One drone: a body of ours, a controller that isn't, and a pilot's sticks."""

    def __init__(
        self,
        physics: Pushed[B],
        body: B,
        controller: Controller,
        settings: DynamicsSettings,
        home: GeoPoint = HOME,
    ) -> None:
        """Puts a drone where it stands.

        Args:
            physics: Moves it, `settings.tick` seconds at a time.
            body: One drone, at rest.
            controller: Turns its rotors.
            settings: Of the body, and of the loops that move the sticks. Betaflight wants a tick
                of `TICK`.
            home: Where on Earth the world's origin is.
        """
        self.physics = physics
        self.body = body
        self.controller = controller
        self.settings = settings
        self.home = home
        self.senses = sense(body, body, settings.tick, 0.0, home)
        self.rotors: Vector = np.zeros(4)
        self.trace: list[Moment] = []
        """Its flight so far."""
        self._ticks = 0
        self._climb = Climb()

    @property
    def time(self) -> float:
        """Seconds since it was put there."""
        return self._ticks * self.settings.tick

    def tick(self, sticks: Sticks) -> None:
        """One tick of the controller and of physics.

        Raises:
            LoopError: The motion has diverged, or see the controller's `step`.
        """
        self.rotors = self.controller.step(self.senses, sticks)
        before = self.body
        self.body = self.physics.push(before, torch.from_numpy(self.rotors)[None], 1)
        self._ticks += 1
        self.senses = sense(before, self.body, self.settings.tick, self.time, self.home)
        if bool(self.body.is_lost[0]) or not np.isfinite(self.senses.position).all():
            raise LoopError(f"the drone's motion diverged after {self.time:.3g} s")

    def hold(self, sticks: Sticks, seconds: float) -> None:
        """Keeps the sticks where they are."""
        for _ in range(round(seconds / self.settings.tick)):
            self.tick(sticks)

    def arm(self, tries: int = 3, settle: float = 3.5, within: float = 1.0) -> None:
        """Arms the firmware: throttle low, the switch first off, then on, until rotors turn.

        Args:
            tries: How many times.
            settle: Seconds before the first, in which the firmware calibrates its instruments.
            within: Seconds in which rotors must turn.

        Raises:
            LoopError: They don't.
        """
        self._climb = Climb()
        self.hold(AT_REST, settle)
        for _ in range(tries):
            for _ in range(round(within / self.settings.tick)):
                self.tick(dataclasses.replace(AT_REST, armed=True))
                if self.rotors.min() > 0.0:
                    return
            self.hold(AT_REST, 0.5)
        raise LoopError(f"the firmware refuses to arm: no rotor turned in {tries} tries")

    def disarm(self, seconds: float = 0.5) -> None:
        """Throttle low and the switch off, for a while."""
        self.hold(AT_REST, seconds)

    def fly(
        self,
        pilot: Pilot[B],
        seconds: float,
        *,
        every: float = PILOT_EVERY,
        until: Callable[[Senses], bool] = lambda senses: False,
    ) -> bool:
        """Flies by a pilot's wishes.

        Args:
            pilot: Is asked at once, and again and again.
            seconds: How long at most.
            every: Seconds from one wish to the next.
            until: Says when it is over, at each wish.

        Returns:
            Whether it was over before the time was.

        Raises:
            LoopError: See `tick`; or the pilot thought for so long that the firmware gave it up.
        """
        tick, between = self.settings.tick, max(1, round(every / self.settings.tick))
        wish, sticks = Wish((0.0, 0.0, 0.0)), AT_REST
        for count in range(round(seconds / tick)):
            if count % between == 0:
                if until(self.senses):
                    return True
                wish = self._asked(pilot)
                self._note()
            if count % STICKS_TICKS == 0:
                sticks = self._move_sticks(wish)
            self.tick(sticks)
        return until(self.senses)

    def _move_sticks(self, wish: Wish) -> Sticks:
        seconds = STICKS_TICKS * self.settings.tick
        sticks, self._climb = sticks_for(wish, self.senses, self._climb, seconds, self.settings)
        return sticks

    def _asked(self, pilot: Pilot[B]) -> Wish:
        """A pilot's wish, on time."""
        begin = time.monotonic()
        wish = pilot(self.body, self.senses)
        thought = time.monotonic() - begin
        if thought > LONGEST_THOUGHT:
            raise LoopError(
                f"the pilot thought for {thought:.2f} s, more than {LONGEST_THOUGHT:g} s; "
                "call it once before the flight, so that it is warm"
            )
        return wish

    def _note(self) -> None:
        s = self.senses
        self.trace.append(Moment(s.time, s.position, s.velocity, self.rotors))
