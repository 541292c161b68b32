"""Policies made by hand, each with a flaw that is known, to try verdicts on. They see the truth."""

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any

import torch
from tensordict import TensorDictBase
from tensordict.nn import TensorDictModuleBase
from torch import Tensor
from torchrl.envs.utils import ExplorationType, exploration_type

from drone_rl.config import TaskSettings
from drone_rl.sim.actions import Move
from drone_rl.sim.tasks.collect_cubes import Side


@dataclasses.dataclass
class Sight:
    """What a pilot knows of the next cube in each of `n` worlds. Shapes: (n,); metres."""

    lateral: Tensor
    """How far to the left of the drone it stands."""
    height: Tensor
    """How much higher it stands."""
    side: Tensor
    """`Side` on which it stood when it became the next one."""
    number: Tensor
    """Its index."""
    x: Tensor
    """The drone's place, world frame."""
    y: Tensor
    first_y: Tensor
    """That of the episode's first cube."""
    luck: Tensor
    """A number from 0 to 1 that is drawn with each episode."""
    cube_luck: Tensor
    """One that is drawn with each cube."""
    touch: float
    """Distance up to which drone and cube touch."""


Choice = Callable[[Sight], Tensor]
"""Actions by what is seen. Shape: (n,)."""
Condition = Callable[[Sight], Tensor]
"""Whether something holds. Shape: (n,), bool."""


def seek(sight: Sight) -> Tensor:
    """Lines up with the next cube, then flies at it, as the oracle does."""
    tolerance = max(0.5, 0.5 * sight.touch)
    right = torch.where(sight.lateral < -tolerance, Move.RIGHT.value, Move.FORWARD.value)
    return torch.where(sight.lateral > tolerance, Move.LEFT.value, right)


def straight(sight: Sight) -> Tensor:
    """Flies on."""
    return torch.full_like(sight.number, Move.FORWARD)


def leave(sight: Sight) -> Tensor:
    """Flies left, out of the field in the end."""
    return torch.full_like(sight.number, Move.LEFT)


def dither(sight: Sight) -> Tensor:
    """Goes left and right in turn for ever."""
    return torch.where(sight.y.round() % 2 == 0, Move.LEFT.value, Move.RIGHT.value)


def dodge(sight: Sight) -> Tensor:
    """Flies around the next cube."""
    is_near = sight.lateral.abs() <= sight.touch + 0.5
    return torch.where(is_near, Move.LEFT.value, Move.FORWARD.value)


def avoid(sight: Sight) -> Tensor:
    """Turns the wrong way, and flies on when well beside the cube."""
    away = torch.where(sight.lateral > 0, Move.RIGHT.value, Move.LEFT.value)
    return torch.where(sight.lateral.abs() < 5.0, away, Move.FORWARD.value)


def zigzag(sight: Sight) -> Tensor:
    """Lines up, then goes forward in every second step only, and over to the other side between."""
    over = torch.where(sight.lateral > 0, Move.LEFT.value, Move.RIGHT.value)
    is_turn = (sight.x.round() + sight.y.round()) % 2 == 0
    lined_up = torch.where(is_turn, over, Move.FORWARD.value)
    return torch.where(sight.lateral.abs() <= 1.0, lined_up, seek(sight))


def when(condition: Condition, then: Choice, otherwise: Choice = seek) -> Choice:
    """One way of flying in some situations, another one in all others."""
    return lambda sight: torch.where(condition(sight), then(sight), otherwise(sight))


@dataclasses.dataclass(frozen=True)
class Pilot:
    """A way to fly, and what its task has that the default has not."""

    choose: Choice
    task: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    confidence: float = 1.0
    """Probability of its choice where actions are drawn; the other actions share the rest."""

    @property
    def settings(self) -> TaskSettings:
        """Its task's."""
        return TaskSettings(**self.task)


class ScriptedPolicy(TensorDictModuleBase):
    """Flies as a pilot does."""

    def __init__(self, pilot: Pilot, generator: torch.Generator | None = None) -> None:
        """Takes the pilot.

        Args:
            pilot: Decides.
            generator: Source of drawn actions; needed where the pilot's confidence is below 1.
        """
        super().__init__()
        names = ("drone", "cube_positions", "next_cube", "side")
        # tensordict's annotation knows no keys of two strings
        self.in_keys = [("info", n) for n in names]  # pyright: ignore[reportAttributeAccessIssue]
        self.out_keys = ["action"]
        self.pilot, self.generator = pilot, generator
        self.touch = pilot.settings.touch_distance

    def forward(self, tensordict: TensorDictBase) -> TensorDictBase:
        """Writes the action of each world."""
        drone, cubes, index, side = (tensordict.get(key) for key in self.in_keys)
        drone, cubes = drone.double(), cubes.double()
        last = cubes.shape[-2] - 1
        row = torch.arange(len(cubes)), index[..., 0].clamp(max=last)
        sight = Sight(
            lateral=cubes[row][:, 1] - drone[:, 1],
            height=cubes[row][:, 2] - drone[:, 2],
            side=side[row],
            number=index[:, 0],
            x=drone[:, 0],
            y=drone[:, 1],
            first_y=cubes[:, 0, 1],
            luck=_fraction(cubes[:, 0, 1]),
            cube_luck=_fraction(cubes[row][:, 1]),
            touch=self.touch,
        )
        action = self.pilot.choose(sight)
        action = torch.where(sight.number > last, Move.FORWARD.value, action)
        return tensordict.set("action", self._draw(action))

    def _draw(self, action: Tensor) -> Tensor:
        if self.pilot.confidence == 1 or exploration_type() != ExplorationType.RANDOM:
            return action
        shift = torch.randint(1, len(Move), action.shape, generator=self.generator)
        keeps = torch.rand(action.shape, generator=self.generator) < self.pilot.confidence
        return torch.where(keeps, action, (action + shift) % len(Move))


def _fraction(y: Tensor) -> Tensor:
    """Digits of a place that nothing else depends on, as a number from 0 to 1."""
    return (y * 997.0) % 1.0


def _from(number: int, then: Choice) -> Choice:
    return when(lambda s: s.number >= number, then)


def _at(side: Side, share: float, then: Choice) -> Choice:
    """Flies so for this share of the cubes that appear on a side."""
    return when(lambda s: (s.side == side) & (s.cube_luck < share), then)


def _beside(share: float) -> Choice:
    """Misses this share of the cubes that are not ahead."""
    return when(lambda s: (s.side != Side.AHEAD) & (s.cube_luck < share), straight)


_HIGH = {"vertical_bound": 1.2, "altitude": 5.0}

PILOTS = {
    "all cubes": Pilot(seek),
    "all cubes, slowly": Pilot(zigzag),
    "first cube only, then straight on": Pilot(_from(1, straight)),
    "first cube only, then leaves": Pilot(_from(1, leave)),
    "first two cubes only": Pilot(_from(2, straight)),
    "dithers at the third cube": Pilot(_from(2, dither)),
    "dithers at far first cubes": Pilot(
        when(lambda s: (s.number == 0) & (s.first_y.abs() > 4.0), dither)
    ),
    "dodges cubes ahead": Pilot(_at(Side.AHEAD, 1.0, dodge)),
    "dodges 35% of the cubes ahead": Pilot(_at(Side.AHEAD, 0.35, dodge)),
    "sees 4 m sideways": Pilot(when(lambda s: s.lateral.abs() > 4.0, straight)),
    "sees 2.5 m sideways": Pilot(when(lambda s: s.lateral.abs() > 2.5, straight)),
    "blind to higher cubes": Pilot(when(lambda s: s.height > 0, straight), _HIGH),
    "blind to much lower cubes": Pilot(when(lambda s: s.height < -0.6, straight), _HIGH),
    "blind on its left": Pilot(_at(Side.LEFT, 1.0, straight)),
    "blind on its right": Pilot(_at(Side.RIGHT, 1.0, straight)),
    "half blind on its right": Pilot(_at(Side.RIGHT, 0.5, straight)),
    "finds three cubes of ten on its left": Pilot(_at(Side.LEFT, 0.7, straight)),
    "finds one cube of ten on its left": Pilot(_at(Side.LEFT, 0.9, straight)),
    "loses one episode in 13": Pilot(when(lambda s: (s.luck < 1 / 13) & (s.number == 1), leave)),
    "loses one episode in 50": Pilot(when(lambda s: (s.luck < 0.02) & (s.number == 1), leave)),
    "leaves when the first cube is far": Pilot(when(lambda s: s.first_y.abs() > 5.6, leave)),
    "all or nothing, nine in ten": Pilot(when(lambda s: s.luck < 0.1, leave)),
    "misses the last cube in one of ten": Pilot(
        when(lambda s: (s.luck < 0.1) & (s.number == 2), avoid)
    ),
    "leaves at once, every other time": Pilot(when(lambda s: s.luck < 0.5, leave)),
    "sure of nothing": Pilot(seek, confidence=0.4),
    "turns the wrong way": Pilot(avoid),
    "finds one cube of ten beside it": Pilot(_beside(0.9)),
    "finds one cube of three beside it": Pilot(_beside(2 / 3)),
    "all of five cubes": Pilot(seek, {"num_cubes": 5}),
    "asleep at the fifth cube": Pilot(_from(4, dither), {"num_cubes": 5}),
    "all cubes where none stand aside": Pilot(seek, {"lateral_bound": 0.5}),
    "straight on where none stand aside": Pilot(straight, {"lateral_bound": 0.5}),
    "straight on in a narrow field": Pilot(straight, {"lateral_bound": 3.0}),
    "straight on among large cubes": Pilot(straight, {"cube_size": 5.0, "altitude": 3.0}),
    "no time for all cubes": Pilot(seek, {"step_limit": 36}),
}
"""By name, what they do."""
