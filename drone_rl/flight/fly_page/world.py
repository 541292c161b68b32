"""One environment of a policy's task: its rules and images, and what a person may change in it."""

import dataclasses
import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import torch
from tensordict.utils import NestedKey
from torch import Tensor

from drone_rl.config import DynamicsSettings
from drone_rl.config.inputs import recorded_inputs
from drone_rl.envs import Observer, base_env
from drone_rl.envs.rollout import ActorAgent, StepContext
from drone_rl.explanations.scenes import Scenes
from drone_rl.policies.actor import Exploring
from drone_rl.policies.policy import Policy
from drone_rl.sim.actions import Actions
from drone_rl.sim.dynamics import BodyState, ComputerVision, FlightState, Quadrotor
from drone_rl.sim.dynamics.state import twist_about_z
from drone_rl.sim.entities import CHASE
from drone_rl.sim.rendering import Appearance
from drone_rl.sim.tasks import ObjectTask
from drone_rl.sim.tasks.common import HIDDEN_DEPTH
from drone_rl.trust.video import probabilities, render_chase

HEIGHT, WIDTH = 144, 256
"""Pixels of the large image; AirSim's default size."""
_HEADING, _ALTITUDE = 2, 3
"""Columns of `FlightState.reference`."""
_OTHER_PERIOD = 0.25
"""Seconds from one action to the next of dynamics that do not state them."""


class Seen(NamedTuple):
    """What the policy observes in the present state, and what it would do."""

    readings: dict[str, Tensor]
    """What its cameras and sensors give, see `drone_rl.envs.readings`. Shapes: (1, *)."""
    inputs: dict[str, Tensor]
    """Inputs of its network. Shapes: (1, *)."""
    probabilities: tuple[float, ...]
    """Of each part of its actions."""
    action: Tensor
    """The action that it takes. Shape: (1,), then that of an action."""
    rest: Tensor | None
    """What else the policy reads, see `drone_rl.explanations.hooks`."""

    @property
    def frame(self) -> Tensor:
        """What its first camera or sensor gives. Shape: (1, H, W, 3) of colors."""
        return next(iter(self.readings.values()))

    @property
    def observation(self) -> Tensor:
        """The first image among its inputs, or else its first input. Shape: (1, C, h, w)."""
        images = (values for values in self.inputs.values() if values.ndim == 4)
        return next(images, next(iter(self.inputs.values())))


class World:
    """One environment with one drone, moved by actions of the policy or by a person."""

    def __init__(
        self, policy: Policy, *, seed: int = 0, greedy: bool = True, renderer: str = "raytrace"
    ) -> None:
        """Create the environment and start an episode.

        Args:
            policy: A policy, whose task, camera, dynamics and appearance the environment has.
            seed: Root of the placements and of the policy's sampled actions.
            greedy: Whether the policy takes the most probable action instead of sampling.
            renderer: Name of the renderer.
        """
        self.policy = policy
        self._env = policy.make_env(1, seed=seed, renderer=renderer)
        self._base = base_env(self._env)
        self.worlds = self._base.worlds
        self.task: Any = self.worlds.task
        self.actions: Actions = self.worlds.dynamics.actions
        self.scenes = Scenes(self._env)
        self._observer = Observer(
            self.worlds,
            self._base.observer.inputs,
            appearance=lambda rows: self._look(),
            streams=lambda rows, key: self._base.side_streams(rows, *key),
        )
        self._actor = ActorAgent(policy.make_actor(self._env, seed=seed))
        self._agent = Exploring(self._actor, greedy=greedy)
        self._every = torch.arange(1)
        self.light = 1.0
        self.wind = _to_polar(policy.dynamics.wind)
        """Speed of the wind, metres a second, and where it comes from; see `set_wind`."""
        self.episode = 0
        """Number of episodes begun."""
        self.reset()

    # State

    def reset(self) -> None:
        """Start a new episode."""
        self.worlds.state.body = self.worlds.bodies(1)  # a person's drone may be of another kind
        self._base.start()
        self._forget()
        self.episode += 1
        self.reward = 0.0
        """Sum of the episode's rewards."""
        self._change()

    @property
    def body(self) -> BodyState:
        """The drone; a batch of one."""
        return self.worlds.state.body

    @property
    def has_dynamics(self) -> bool:
        """Whether the policy flies a drone with dynamics, and wind has an effect."""
        return isinstance(self.worlds.dynamics, Quadrotor)

    @property
    def end(self) -> str | None:
        """How the episode ended, such as "with every cube collected"; None while it goes on."""
        reason = int(self.worlds.state.end_reason[0])
        return self.task.vocabulary.ending(self.task.ends(reason).name.lower()) if reason else None

    @property
    def goals(self) -> tuple[int, int]:
        """Number of goals reached, and of all goals."""
        reached = self.task.score(self.worlds.info()).reached[0]
        return int(reached.sum()), len(reached)

    @property
    def objects(self) -> list[tuple[float, float, float] | None]:
        """Positions of the task's objects, metres; None for those that have vanished."""
        scenes = len(getattr(self.task, "scenes", ()))  # their origins come last
        places = self.task.places(self.worlds.state)[0].tolist()
        places = places[: len(places) - scenes]
        return [None if z < -HIDDEN_DEPTH / 2 else (x, y, z) for x, y, z in places]

    # The policy's actions

    def seconds(self, speed: float) -> float:
        """Return the seconds that an action lasts; moves without dynamics have that speed, m/s."""
        dynamics = self.worlds.dynamics
        if isinstance(dynamics, ComputerVision):
            return dynamics.step_length / speed
        return getattr(dynamics, "timestep", None) or _OTHER_PERIOD

    def align(self) -> None:
        """Prepare the drone, which a person may have turned or lifted, for the policy's actions.

        A drone without dynamics is levelled at once, at the task's altitude unless its actions
        change that; one with dynamics gets heading and altitude as targets of its controller. The
        heading is that of the start, 0, unless the actions change it.
        """
        body, start = self.body, self.worlds.dynamics.start(self.body.position)
        altitude, names = self.task.origin[2], self.actions.names
        turns, climbs = "turn left" in names, "up" in names
        if isinstance(start, FlightState):
            same = (
                body if isinstance(body, FlightState) else start.moved(body.position, body.attitude)
            )
            flying = same.settled()
            if not turns:
                flying.reference[:, _HEADING] = 0.0
            if not climbs:
                flying.reference[:, _ALTITUDE] = altitude
            self._place(flying)
            return
        place = start.position.clone()
        if not climbs:
            place[:, 2] = altitude
        self._place(start.moved(place, twist_about_z(body.attitude) if turns else None))

    @torch.no_grad()
    def see(self) -> Seen:
        """Return what the policy observes and would do; computed once for each state."""
        if self._seen is None:
            starts = torch.tensor([self._memory is None])
            if self._memory is not None:  # the state may have been seen before, in another light
                seen, self._actor.memory = self._memory
                self._observer.load_state_dict(seen)
            context = StepContext(self._observer, self.worlds.state, self._every, starts)
            shares = probabilities(act := self._agent.act(context), self.actions)
            rest, shares = self.scenes.rest_of(act.entries), tuple(shares.tolist())
            self._seen = Seen(context.readings, context.inputs, shares, act.action, rest)
        return self._seen

    def step(self, action: Tensor) -> float:
        """Take an action, (1,) and then its shape; return the reward."""
        self.see()
        self._memory = self._observer.state_dict(), self._actor.memory
        reward = float(self.worlds.step(self._every, action)[0])
        self.reward += reward
        self._change()
        return reward

    @property
    def is_over(self) -> bool:
        """Whether the episode has ended."""
        return bool(self.worlds.state.end_reason[0] != 0)

    # What a person does

    def move(self, body: BodyState) -> None:
        """Put the drone somewhere. No time passes; contact is the only rule that applies."""
        self._forget()
        self._place(body)
        if isinstance(self.task, ObjectTask):
            state: Any = self.worlds.state
            self.task.touch(state, body.position)

    def set_light(self, light: float) -> None:
        """Set the factor by which cameras multiply all colors."""
        self.light = light
        self._change()

    def set_wind(self, speed: float, direction: float) -> None:
        """Set the wind: metres a second, and where it comes from.

        The direction is in degrees, clockwise from above: 0 straight ahead, 90 from the right. Only
        drones with dynamics feel it.
        """
        self.wind = speed, direction
        if self.has_dynamics:
            self.worlds.dynamics = Quadrotor(self.flight_dynamics, self.policy.actions)
            self._change()

    @property
    def flight_dynamics(self) -> DynamicsSettings:
        """Dynamics, with the present wind, of the policy's drone, else of AirSim's."""
        speed, direction = self.wind
        base = self.policy.dynamics if self.has_dynamics else DynamicsSettings(mode="simple_flight")
        if self.wind == _to_polar(base.wind):  # unchanged: its exact numbers, for demonstrations
            return base
        angle, upward = math.radians(direction), self.policy.dynamics.wind[2]
        level = (-speed * math.cos(angle), speed * math.sin(angle))
        return base.replace(wind=(*(round(along, 9) + 0.0 for along in level), upward))

    @property
    def conditions(self) -> dict[str, Any]:
        """The fields of `FlightConditions`, under which flights are recorded."""
        policy = self.policy
        dynamics = self.flight_dynamics if self.has_dynamics else policy.dynamics
        camera, actions = policy.description.camera, policy.actions
        return {
            "task": policy.task,
            "camera": camera,
            "dynamics": dynamics,
            "actions": actions,
            "inputs": recorded_inputs(policy.description.inputs),
        }

    # Images

    def render(self, camera: str) -> Tensor:
        """Render one of AirSim's five cameras, or the drone from behind. (H, W, 3), uint8."""
        if camera == CHASE.name:
            return render_chase(self.worlds, self._look(), HEIGHT, WIDTH)[0]
        view = self.worlds.view(camera, "rgb", HEIGHT, WIDTH)
        return self.worlds.render(self.worlds.state, view, self._look())[0]

    def close(self) -> None:
        """Close the renderer."""
        self._env.close()

    def _look(self) -> Appearance | None:
        """Return the episode's appearance under the present light; one object until it changes."""
        appearance = self._base.appearances.current()
        if self.light == 1.0:
            return appearance
        if self._lit is None:
            whole = appearance or self._base.appearances.middle or Appearance()
            exposure = self.light * (1.0 if whole.exposure is None else whole.exposure)
            self._lit = dataclasses.replace(whole, exposure=exposure)
        return self._lit

    def _forget(self) -> None:
        """Let the policy begin without earlier frames."""
        self._memory: tuple[dict[str, Any], Mapping[NestedKey, Tensor]] | None = None
        """That of the observer and of the policy after the last step."""

    def _place(self, body: BodyState) -> None:
        self.worlds.state.body = body
        self._change()

    def _change(self) -> None:
        self._seen: Seen | None = None
        self._lit: Appearance | None = None


def _to_polar(wind: tuple[float, float, float]) -> tuple[float, float]:
    """Return speed and direction, see `World.set_wind`, of the air's velocity."""
    x, y, _ = wind
    return math.hypot(x, y), math.degrees(math.atan2(y, 0.0 - x)) % 360.0
