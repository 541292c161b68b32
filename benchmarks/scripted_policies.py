"""Scripted policies with known flaws, for tests of verdicts. They read the true state."""

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any

import torch
from tensordict import TensorDictBase
from tensordict.nn import TensorDictModuleBase
from torch import Tensor
from torchrl.envs.utils import ExplorationType

from drone_rl.config import TaskSettings
from drone_rl.policies.actor import current_exploration
from drone_rl.sim.actions import Move
from drone_rl.sim.tasks.collect_cubes import Side


@dataclasses.dataclass
class State:
    """State of the drone and its next cube in `n` environments. Shapes: (n,); metres."""

    lateral: Tensor
    """Distance of the cube to the left of the drone."""
    height: Tensor
    """Height of the cube above the drone."""
    side: Tensor
    """`Side` of the cube when it became the next one."""
    number: Tensor
    """Index of the cube."""
    x: Tensor
    """Position of the drone, world frame."""
    y: Tensor
    first_y: Tensor
    """Lateral position of the episode's first cube."""
    episode_random: Tensor
    """A pseudo-random number from 0 to 1 for each episode."""
    cube_random: Tensor
    """A pseudo-random number from 0 to 1 for each cube."""
    touch: float
    """Largest distance at which drone and cube touch."""


Behavior = Callable[[State], Tensor]
"""Return actions. Shape: (n,)."""
Condition = Callable[[State], Tensor]
"""Return whether a condition holds. Shape: (n,), bool."""


def seek(state: State) -> Tensor:
    """Align with the next cube, then fly towards it, as the oracle does."""
    tolerance = max(0.5, 0.5 * state.touch)
    right = torch.where(state.lateral < -tolerance, Move.RIGHT.value, Move.FORWARD.value)
    return torch.where(state.lateral > tolerance, Move.LEFT.value, right)


def straight(state: State) -> Tensor:
    """Fly straight."""
    return torch.full_like(state.number, Move.FORWARD)


def leave(state: State) -> Tensor:
    """Fly left until the drone leaves the field."""
    return torch.full_like(state.number, Move.LEFT)


def dither(state: State) -> Tensor:
    """Alternate between left and right until the step limit."""
    return torch.where(state.y.round() % 2 == 0, Move.LEFT.value, Move.RIGHT.value)


def dodge(state: State) -> Tensor:
    """Fly around the next cube."""
    is_near = state.lateral.abs() <= state.touch + 0.5
    return torch.where(is_near, Move.LEFT.value, Move.FORWARD.value)


def avoid(state: State) -> Tensor:
    """Move away from the next cube, then fly straight."""
    away = torch.where(state.lateral > 0, Move.RIGHT.value, Move.LEFT.value)
    return torch.where(state.lateral.abs() < 5.0, away, Move.FORWARD.value)


def zigzag(state: State) -> Tensor:
    """Align with the next cube, then alternate between forward and sideways moves."""
    over = torch.where(state.lateral > 0, Move.LEFT.value, Move.RIGHT.value)
    is_turn = (state.x.round() + state.y.round()) % 2 == 0
    aligned = torch.where(is_turn, over, Move.FORWARD.value)
    return torch.where(state.lateral.abs() <= 1.0, aligned, seek(state))


def when(condition: Condition, then: Behavior, otherwise: Behavior = seek) -> Behavior:
    """Return a behavior that switches between two others."""
    return lambda state: torch.where(condition(state), then(state), otherwise(state))


@dataclasses.dataclass(frozen=True)
class Script:
    """A behavior and the task for it."""

    choose: Behavior
    task: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    """Settings that differ from the default task."""
    confidence: float = 1.0
    """Probability of the chosen action if actions are sampled; the others are equally likely."""

    @property
    def settings(self) -> TaskSettings:
        """Settings of the task."""
        return TaskSettings(**self.task)


class ScriptedPolicy(TensorDictModuleBase):
    """A policy that runs a script."""

    def __init__(self, script: Script, generator: torch.Generator | None = None) -> None:
        """Store the script.

        Args:
            script: Chooses the actions.
            generator: Random generator of sampled actions; required if confidence is below 1.
        """
        super().__init__()
        names = ("drone", "cube_positions", "next_cube", "side")
        # tensordict does not annotate nested keys
        self.in_keys = [("info", n) for n in names]  # pyright: ignore[reportAttributeAccessIssue]
        self.out_keys = ["action"]
        self.script, self.generator = script, generator
        self.touch = script.settings.touch_distance

    def forward(self, tensordict: TensorDictBase) -> TensorDictBase:
        """Write the action of each environment."""
        drone, cubes, index, side = (tensordict.get(key) for key in self.in_keys)
        drone, cubes = drone.double(), cubes.double()
        last = cubes.shape[-2] - 1
        row = torch.arange(len(cubes)), index[..., 0].clamp(max=last)
        state = State(
            lateral=cubes[row][:, 1] - drone[:, 1],
            height=cubes[row][:, 2] - drone[:, 2],
            side=side[row],
            number=index[:, 0],
            x=drone[:, 0],
            y=drone[:, 1],
            first_y=cubes[:, 0, 1],
            episode_random=_fraction(cubes[:, 0, 1]),
            cube_random=_fraction(cubes[row][:, 1]),
            touch=self.touch,
        )
        action = self.script.choose(state)
        action = torch.where(state.number > last, Move.FORWARD.value, action)
        return tensordict.set("action", self._sample(action))

    def _sample(self, action: Tensor) -> Tensor:
        if self.script.confidence == 1 or current_exploration() != ExplorationType.RANDOM:
            return action
        shift = torch.randint(1, len(Move), action.shape, generator=self.generator)
        keeps = torch.rand(action.shape, generator=self.generator) < self.script.confidence
        return torch.where(keeps, action, (action + shift) % len(Move))


def _fraction(y: Tensor) -> Tensor:
    """Return the low-order digits of a position as a number from 0 to 1."""
    return (y * 997.0) % 1.0


def _from(number: int, then: Behavior) -> Behavior:
    """Switch to another behavior from a cube on."""
    return when(lambda s: s.number >= number, then)


def _at(side: Side, share: float, then: Behavior) -> Behavior:
    """Use another behavior for a fraction of the cubes on a side."""
    return when(lambda s: (s.side == side) & (s.cube_random < share), then)


def _beside(share: float) -> Behavior:
    """Miss a fraction of the cubes that are not ahead."""
    return when(lambda s: (s.side != Side.AHEAD) & (s.cube_random < share), straight)


_HIGH = {"vertical_bound": 1.2, "altitude": 5.0}

SCRIPTS = {
    "all cubes": Script(seek),
    "all cubes, slowly": Script(zigzag),
    "first cube only, then straight on": Script(_from(1, straight)),
    "first cube only, then leaves": Script(_from(1, leave)),
    "first two cubes only": Script(_from(2, straight)),
    "dithers at the third cube": Script(_from(2, dither)),
    "dithers at far first cubes": Script(
        when(lambda s: (s.number == 0) & (s.first_y.abs() > 4.0), dither)
    ),
    "dodges cubes ahead": Script(_at(Side.AHEAD, 1.0, dodge)),
    "dodges 35% of the cubes ahead": Script(_at(Side.AHEAD, 0.35, dodge)),
    "sees 4 m sideways": Script(when(lambda s: s.lateral.abs() > 4.0, straight)),
    "sees 2.5 m sideways": Script(when(lambda s: s.lateral.abs() > 2.5, straight)),
    "blind to higher cubes": Script(when(lambda s: s.height > 0, straight), _HIGH),
    "blind to much lower cubes": Script(when(lambda s: s.height < -0.6, straight), _HIGH),
    "blind on its left": Script(_at(Side.LEFT, 1.0, straight)),
    "blind on its right": Script(_at(Side.RIGHT, 1.0, straight)),
    "half blind on its right": Script(_at(Side.RIGHT, 0.5, straight)),
    "finds three cubes of ten on its left": Script(_at(Side.LEFT, 0.7, straight)),
    "finds one cube of ten on its left": Script(_at(Side.LEFT, 0.9, straight)),
    "loses one episode in 13": Script(
        when(lambda s: (s.episode_random < 1 / 13) & (s.number == 1), leave)
    ),
    "loses one episode in 50": Script(
        when(lambda s: (s.episode_random < 0.02) & (s.number == 1), leave)
    ),
    "leaves when the first cube is far": Script(when(lambda s: s.first_y.abs() > 5.6, leave)),
    "all or nothing, nine in ten": Script(when(lambda s: s.episode_random < 0.1, leave)),
    "misses the last cube in one of ten": Script(
        when(lambda s: (s.episode_random < 0.1) & (s.number == 2), avoid)
    ),
    "leaves at once, every other time": Script(when(lambda s: s.episode_random < 0.5, leave)),
    "sure of nothing": Script(seek, confidence=0.4),
    "turns the wrong way": Script(avoid),
    "finds one cube of ten beside it": Script(_beside(0.9)),
    "finds one cube of three beside it": Script(_beside(2 / 3)),
    "all of five cubes": Script(seek, {"num_cubes": 5}),
    "asleep at the fifth cube": Script(_from(4, dither), {"num_cubes": 5}),
    "all cubes where none stand aside": Script(seek, {"lateral_bound": 0.5}),
    "straight on where none stand aside": Script(straight, {"lateral_bound": 0.5}),
    "straight on in a narrow field": Script(straight, {"lateral_bound": 3.0}),
    "straight on among large cubes": Script(straight, {"cube_size": 5.0, "altitude": 3.0}),
    "no time for all cubes": Script(seek, {"step_limit": 36}),
}
"""Scripts by name."""
