"""How controls and the policy move the drone: moves of the policy, poses, velocities."""

import abc
from collections.abc import Callable, Iterable
from typing import Any

import torch
from torch import Tensor

from drone_rl.config import DynamicsSettings
from drone_rl.flight.commands.drone import KEYS, STEP, TURN
from drone_rl.flight.commands.path_following import YawMode
from drone_rl.flight.commands.pilot import Pilot
from drone_rl.flight.commands.state import LandedState
from drone_rl.flight.fly_page.world import World
from drone_rl.sim.actions import Actions
from drone_rl.sim.dynamics import FlightState, Obstacles, Quadrotor

CONTROLS = tuple(KEYS)
"""Names of controls that can be held: those of `Pilot.press`."""
_MOST_PRESSES = 8
"""Presses that wait for the next step."""
_DELAY = 0.3
"""Seconds after which a held control repeats."""
_TURN_RATE = 60.0
"""Degrees a second at full turn."""
_CLIMB = 0.5
"""Largest climb as a fraction of the speed."""
_LOWEST = 0.3
"""Height under which poses can't be lowered, metres."""
_LONG = 1e5
"""Seconds of a command that a new one ends."""
_BRAKING = 2.5
"""Most seconds of braking before the drone holds its place; wind may keep it from standing."""
_STANDS = 0.25
"""Speed at which braking is over, m/s."""
_AXES = (("forward", "backward"), ("left", "right"), ("up", "down"), ("yaw_left", "yaw_right"))
_PARTS = {"backward": "back", "yaw_left": "turn left", "yaw_right": "turn right"}
"""Actions of controls with other names."""
_MOST_STEPS = 5
"""Steps at once after a delay; more are dropped."""


def parts_of(actions: Actions) -> dict[str, int]:
    """Return the parts that controls choose, by the names of the controls."""
    parts = ((name, actions.like(_PARTS.get(name, name))) for name in CONTROLS)
    return {name: part for name, part in parts if part is not None}


class Controls:
    """Held keys and buttons, and presses that were not used yet."""

    def __init__(self) -> None:
        """Begin with nothing held."""
        self.presses: list[str] = []
        self._since: dict[str, float] = {}
        """Seconds since each held control was pressed, in order of the presses."""

    def hold(self, keys: Iterable[str]) -> None:
        """Take the names of all held keys; new ones are presses."""
        held = dict.fromkeys(keys)
        self.presses += [name for name in held if name not in self._since]
        del self.presses[:-_MOST_PRESSES]
        kept = {name: since for name, since in self._since.items() if name in held}
        self._since = kept | {name: 0.0 for name in held if name not in kept}

    def release(self) -> None:
        """Let go of everything."""
        self.presses.clear()
        self._since = {}

    def advance(self, seconds: float) -> None:
        """Let time pass for held controls."""
        self._since = {name: since + seconds for name, since in self._since.items()}

    @property
    def repeating(self) -> list[str]:
        """Controls that are held long enough to repeat, the last pressed last."""
        return [name for name, since in self._since.items() if since >= _DELAY]

    @property
    def axes(self) -> list[float]:
        """Forward, left, up and turn left by held keys: -1, 0 or 1 each."""
        return [float((plus in self._since) - (minus in self._since)) for plus, minus in _AXES]


class FlyPilot(abc.ABC):
    """Moves the drone of a world over time."""

    def __init__(self, world: World) -> None:
        """Take the world, whose drone may be anywhere."""
        self.world = world

    @abc.abstractmethod
    def advance(self, seconds: float, controls: Controls, speed: float) -> None:
        """Let time pass. `speed` is in metres a second."""


Note = Callable[[dict[str, Tensor], Tensor, float], None]
"""Called with image, action and reward of each step: (1, H, W, 3), (1, ...)."""


class _Steps(FlyPilot):
    """Takes actions of the policy's environment, one each period."""

    def __init__(self, world: World, note: Note) -> None:
        """Take the world, and a function that is called with each step."""
        super().__init__(world)
        world.align()
        self._note, self._left = note, 0.0

    def _take(self, action: Tensor) -> None:
        readings = self.world.see().readings
        self._note(readings, action, self.world.step(action))

    def _due(self, seconds: float, speed: float) -> int:
        """Return the number of actions that are due."""
        self._left += seconds
        period = self.world.seconds(speed)
        count = int(self._left / period + 1e-9)
        self._left -= count * period
        return min(count, _MOST_STEPS)


class PolicyPilot(_Steps):
    """The policy flies."""

    def advance(self, seconds: float, controls: Controls, speed: float) -> None:
        """See `FlyPilot`."""
        for _ in range(self._due(seconds, speed)):
            if not self.world.is_over:
                self._take(self.world.see().action)


class ActionPilot(_Steps):
    """A person chooses the policy's actions; time stands still between them."""

    def advance(self, seconds: float, controls: Controls, speed: float) -> None:
        """See `FlyPilot`."""
        is_discrete = not self.world.actions.entry.shape
        choose = self._discrete if is_discrete else self._continuous
        chosen = choose(seconds, controls, speed)
        controls.presses.clear()
        for action in chosen:
            if not self.world.is_over:
                self._take(action)

    def _discrete(self, seconds: float, controls: Controls, speed: float) -> list[Tensor]:
        parts = parts_of(self.world.actions)
        held = [name for name in controls.repeating if name in parts]
        count = self._due(seconds, speed) if held else 0
        if not held:
            self._left = 0.0
        pressed = [name for name in controls.presses if name in parts]
        return [torch.tensor([parts[name]]) for name in (*pressed, *held[-1:] * count)]

    def _continuous(self, seconds: float, controls: Controls, speed: float) -> list[Tensor]:
        actions: Any = self.world.actions
        deflections = zip(_AXES, controls.axes, strict=True)
        parts = parts_of(actions)
        axes = [value if plus in parts else 0.0 for (plus, _), value in deflections]
        if not any(axes):
            self._left = 0.0
            return []
        count = max(bool(controls.presses), self._due(seconds, speed))
        return [actions.commanded(*axes)[None]] * count


class _Drone(Pilot):
    """A drone that is taken over in flight, and whose trajectory is not kept."""

    lifts_off, kept_states = True, 1  # a page may be open for days

    def take_over(self, body: FlightState) -> None:
        """Continue with a drone that flies, or is posed, anywhere."""
        self.body, self._is_armed, self._landed = body, True, LandedState.FLYING

    def set_surroundings(self, dynamics: DynamicsSettings, obstacles: Obstacles | None) -> None:
        """Take the wind and the obstacles of the present episode."""
        if dynamics != self.settings:
            self._quadrotor, self.settings = Quadrotor(dynamics), dynamics
        self._obstacles = obstacles

    @property
    def period(self) -> float:
        """Seconds of a control period."""
        return self._period * self.settings.tick

    def run(self) -> None:
        """Advance by a control period."""
        self._advance(self._period)


class PosePilot(FlyPilot):
    """Computer-vision mode: controls change the pose by steps of 0.25 m and 5 degrees.

    What is solid in a scene file ends a step.
    """

    def __init__(self, world: World) -> None:
        """Take over the drone's place and attitude."""
        super().__init__(world)
        self._drone = _Drone(mode="computer_vision")
        self._drone.body = self._drone.body.moved(world.body.position, world.body.attitude)
        self._left = dict.fromkeys(CONTROLS, 0.0)
        world.move(self._drone.body)

    def advance(self, seconds: float, controls: Controls, speed: float) -> None:
        """See `FlyPilot`."""
        keys = [*controls.presses]
        controls.presses.clear()
        for name in controls.repeating:
            rate = speed / STEP if KEYS[name][0] < 3 else _TURN_RATE / TURN
            self._left[name] += seconds * rate
            count = int(self._left[name])
            self._left[name] -= count
            keys += [name] * count
        around = self.world.task.obstacles(self.world.worlds.state)
        scene = None if around is None else around.scene
        for name in keys:
            before = self._drone.body.position
            if name == "down" and scene is None and float(before[0, 2]) - STEP < _LOWEST:
                continue
            self._drone.press(name)
            if scene is not None:
                body = self._drone.body
                self._drone.body = body.moved(scene.reached(before, body.position), body.attitude)
        if keys:
            self.world.move(self._drone.body)


class VelocityPilot(FlyPilot):
    """Simple flight: controls command velocities; without them the drone holds its place."""

    def __init__(self, world: World) -> None:
        """Take over the drone in flight; one without dynamics begins to hover."""
        super().__init__(world)
        self._drone = _Drone(world.flight_dynamics)
        body = world.body
        if not isinstance(body, FlightState) or not bool(body.rotors.any()):
            start = Quadrotor(world.flight_dynamics).start(body.position)
            body = start.moved(body.position, body.attitude)
        self._drone.take_over(body)
        world.move(body)
        self._command: tuple[float, ...] | None = None
        self._braking = self._left = 0.0
        self._hold()

    def take_off(self) -> None:
        """Climb 2 m."""
        self._drone.take_off(wait=False)
        self._command, self._braking = (), 0.0

    def land(self) -> None:
        """Descend until the drone stands."""
        self._drone.land(wait=False)
        self._command, self._braking = (), 0.0

    def advance(self, seconds: float, controls: Controls, speed: float) -> None:
        """See `FlyPilot`."""
        world, drone = self.world, self._drone
        controls.presses.clear()
        if bool(drone.body.is_lost[0]):
            return
        drone.set_surroundings(world.flight_dynamics, world.task.obstacles(world.worlds.state))
        self._steer(seconds, controls, speed)
        self._left += seconds
        while self._left >= drone.period:
            drone.run()
            world.move(drone.body)
            self._left -= drone.period

    def _steer(self, seconds: float, controls: Controls, speed: float) -> None:
        forward, left, up, turn = controls.axes
        if any((forward, left, up, turn)):
            self._braking = _BRAKING
            self._command_velocity(
                speed * forward, speed * left, _CLIMB * speed * up, _TURN_RATE * turn
            )
        elif self._braking > 0.0:
            self._braking -= seconds
            self._command_velocity(0.0, 0.0, 0.0, 0.0)
            if self._braking <= 0.0 or float(self._drone.body.velocity.norm()) < _STANDS:
                self._braking = 0.0
                self._hold()
        elif self._drone.running is None:  # take-off or landing is over
            self._command = None

    def _command_velocity(self, *velocity: float) -> None:
        if velocity != self._command:
            forward, left, up, turn = velocity
            yaw = YawMode(True, 0.0 - turn)
            self._drone.move_by_velocity(
                forward, left, up, _LONG, frame="body", yaw_mode=yaw, wait=False
            )
            self._command = velocity

    def _hold(self) -> None:
        self._drone.hover(_LONG, wait=False)
        self._command = None


def make_pilot(mode: str, world: World, note: Note) -> FlyPilot:
    """Return what flies the drone: "policy", or one of `FLY_MODES` for a person."""
    if mode in ("policy", "actions"):
        return (PolicyPilot if mode == "policy" else ActionPilot)(world, note)
    return (PosePilot if mode == "computer_vision" else VelocityPilot)(world)
