"""Sets of actions, and distances between their probabilities.

A network's output gives the probabilities of named *parts*, which add up to 1. Parts are the
discrete actions, or kinds of continuous actions, such as "left".
"""

import abc
import dataclasses
import enum
import functools
import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, TypeVar

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from drone_rl.sim.vocabulary import ShownActions
from drone_rl.utils import palette
from drone_rl.utils.palette import Rgb

Probs = TypeVar("Probs", Tensor, NDArray)
"""Probabilities of the parts, or a batch of them. Shape: (*, num_parts)."""


class Entry(NamedTuple):
    """Shape, type and bounds of an array, for one environment."""

    shape: tuple[int, ...]
    dtype: torch.dtype
    low: float | None = None
    high: float | None = None


@dataclasses.dataclass(frozen=True, kw_only=True)
class Actions(abc.ABC):
    """A set of actions and its numbered parts; probabilities are a tensor or a NumPy array.

    An *action* is what dynamics take, shaped as `entry` says; a *part* is a number, int64.
    """

    names: tuple[str, ...]
    mirrored: tuple[int, ...]
    """Mirror image of each; that of its mirror image is itself."""
    opposite: tuple[int, ...]
    """The part that undoes each; itself where none does."""
    left: int
    """The part that goes left; its mirror image goes right."""
    order: tuple[int, ...]
    """All parts from left to right, as plots show them."""
    arrows: tuple[tuple[float, float], ...]
    """Direction of each on a page, right and up: length 1, or 0 for none."""
    colors: tuple[Rgb, ...]

    def __len__(self) -> int:
        return len(self.names)

    @property
    def right(self) -> int:
        """The part that goes right."""
        return self.mirrored[self.left]

    @property
    def lefts(self) -> tuple[int, ...]:
        """All parts that go or turn left; their mirror images lead to the right."""
        speeds = (_speeds_by_name(name) for name in self.names)
        leading = (i for i, (_, left, _, turn) in enumerate(speeds) if left + turn > 0)
        return tuple(sorted({self.left, *leading}))

    def like(self, name: str) -> int | None:
        """Return the part of a name, None if there is none.

        Without sideways parts, "left" and "right" are those that turn.
        """
        sides = {"left": self.left, "right": self.right}
        return self.names.index(name) if name in self.names else sides.get(name)

    def chosen(self, probs: Tensor) -> Tensor:
        """Return the most probable part. Shape: (*)."""
        return probs.argmax(-1)

    def mirror(self, probs: Probs) -> Probs:
        """Return the probabilities of the mirror images. Shape kept."""
        return probs[..., list(self.mirrored)]

    def distance(self, probs: Probs, other: Probs) -> Probs:
        """Return the total variation: half the sum of the absolute differences. Shape: (*)."""
        return 0.5 * abs(probs - other).sum(-1)  # pyright: ignore[reportReturnType] (of arrays and tensors)

    def prob_left(self, probs: Probs) -> Probs:
        """Return the probability of all parts to the left. Shape: (*)."""
        return probs[..., list(self.lefts)].sum(-1)  # pyright: ignore[reportReturnType] (of both)

    def opposition(self, probs: NDArray, other: NDArray) -> NDArray:
        """Return how opposed two distributions are, -1 to 1; below 0 if the second prefers left.

        This is the smaller of the changes to the left and to the right, 0 if their signs differ.
        It is 1 if the first is certainly left and the second certainly right. Shape: (*).
        """
        swing = probs - other
        to_left, to_right = self.prob_left(swing), -self.prob_left(self.mirror(swing))
        agreed = np.sign(to_left) == np.sign(to_right)
        least = np.minimum(np.abs(to_left), np.abs(to_right))
        return np.where(agreed, np.sign(to_left) * least, 0.0)

    def undoes(self, part: Tensor, before: Tensor) -> Tensor:
        """Return whether a part undoes the one before it. Shape: (*), bool."""
        return (part == _take(self.opposite, before)) & (part != before)

    def can_be_undone(self, part: Tensor) -> Tensor:
        """Return whether a part has an opposite. Shape: (*), bool."""
        return _take(self.opposite, part) != part

    def goes_forward(self, part: Tensor) -> Tensor:
        """Return whether a part goes forward. Shape: (*), bool."""
        return _speeds(self.names, part.device)[part][..., 0] > 0

    def turns(self, part: Tensor) -> Tensor:
        """Return whether a part differs from its mirror image. Shape: (*), bool."""
        return _take(self.mirrored, part) != part

    def agrees(self, part: Tensor, other: Tensor) -> Tensor:
        """Return whether parts are equal or lead to the same side. Shape: (*), bool."""
        rights = [self.mirrored[left] for left in self.lefts]
        sides = [(i in self.lefts) - (i in rights) for i in range(len(self))]
        here, there = _take(sides, part), _take(sides, other)
        return (part == other) | ((here == there) & (here != 0))

    @property
    def shown(self) -> ShownActions:
        """What reports need to name and plot the parts."""
        order = tuple(map(int, self.order))
        return ShownActions(names=self.names, order=order, arrows=self.arrows, colors=self.colors)

    @property
    @abc.abstractmethod
    def entry(self) -> Entry:
        """Shape, type and bounds of one environment's action."""

    @property
    def num_outputs(self) -> int:
        """Number of the network's outputs."""
        return len(self.output_names)

    @property
    @abc.abstractmethod
    def output_names(self) -> tuple[str, ...]:
        """Names of the network's outputs."""

    @abc.abstractmethod
    def probabilities(self, outputs: Tensor) -> Tensor:
        """Return the probabilities of the parts. (*, num_outputs) to (*, len(names))."""

    @abc.abstractmethod
    def scores(self, outputs: Tensor) -> Tensor:
        """Return unbounded scores that grow with the probabilities. Shapes likewise."""

    @abc.abstractmethod
    def greedy(self, outputs: Tensor) -> Tensor:
        """Return the most probable action. (*, num_outputs) to (*), then the entry's."""

    @abc.abstractmethod
    def part(self, action: Tensor) -> Tensor:
        """Return the parts that actions belong to. (*), then the entry's, to (*)."""

    @abc.abstractmethod
    def always(self, name: str) -> Tensor:
        """Return the full-speed action of a part, by name. Shape: the entry's."""

    def speeds_of(self, action: Tensor) -> Tensor:
        """Return the commanded speeds: forward, left, up and turning left, 1 is the greatest.

        By default those of the action's part by name, see `PARTS`; zero for other names.
        Shapes: (*), then the entry's, to (*, 4), float32.
        """
        return _speeds(self.names, action.device)[self.part(action)]

    @abc.abstractmethod
    def sample(self, shape: tuple[int, ...], generator: torch.Generator) -> Tensor:
        """Sample uniformly, on the generator's device. Shape: `shape`, then the entry's."""

    @abc.abstractmethod
    def fields(self) -> dict[str, str]:
        """Return the entries that data sets keep of an action, with descriptions."""

    @abc.abstractmethod
    def kept(self, action: Tensor) -> dict[str, Tensor]:
        """Return these entries; "actions" are the parts. (T), then the entry's, to (T, *)."""

    @abc.abstractmethod
    def is_reversible(self, kept: Mapping[str, Tensor]) -> Tensor:
        """Return whether actions, as `kept`, are steps of going back and forth. (T,), bool."""


@functools.lru_cache(maxsize=64)
def _speeds(names: tuple[str, ...], device: torch.device) -> Tensor:
    return torch.tensor([_speeds_by_name(name) for name in names], device=device)


def _speeds_by_name(name: str) -> tuple[float, float, float, float]:
    return PARTS[name].speeds if name in PARTS else (0.0, 0.0, 0.0, 0.0)


def _take(values: Sequence[int], part: Tensor) -> Tensor:
    return torch.tensor(values, device=part.device)[part]


@dataclasses.dataclass(frozen=True, kw_only=True)
class DiscreteActions(Actions):
    """A few numbered actions, each of which is a part. See `Actions`."""

    @property
    def entry(self) -> Entry:
        """A number."""
        return Entry((), torch.int64, 0, len(self) - 1)

    @property
    def output_names(self) -> tuple[str, ...]:
        """The names of the actions, one logit each."""
        return self.names

    def probabilities(self, outputs: Tensor) -> Tensor:
        """Return the softmax of logits (Eq. 9)."""
        return outputs.softmax(-1)

    def scores(self, outputs: Tensor) -> Tensor:
        """Return the logits."""
        return outputs

    def greedy(self, outputs: Tensor) -> Tensor:
        """Return the action with the largest logit."""
        return outputs.argmax(-1)

    def part(self, action: Tensor) -> Tensor:
        """Return the action itself."""
        return action

    def always(self, name: str) -> Tensor:
        """Return the number of the action."""
        return torch.tensor(self.names.index(name))

    def sample(self, shape: tuple[int, ...], generator: torch.Generator) -> Tensor:
        """Sample numbers."""
        return torch.randint(len(self), shape, generator=generator, device=generator.device)

    def fields(self) -> dict[str, str]:
        """Return the entry of the action's number."""
        return {"actions": "action taken: " + listed(self.names)}

    def kept(self, action: Tensor) -> dict[str, Tensor]:
        """Return the action's number."""
        return {"actions": action}

    def is_reversible(self, kept: Mapping[str, Tensor]) -> Tensor:
        """Return whether actions have an opposite and don't go forward."""
        return self.can_be_undone(kept["actions"]) & ~self.goes_forward(kept["actions"])


def listed(names: tuple[str, ...]) -> str:
    """Return names with their numbers, for descriptions."""
    return ", ".join(f"{number} {name}" for number, name in enumerate(names))


class Part(NamedTuple):
    """A part of actions that goes or turns one way, in the drone's frame."""

    speeds: tuple[float, float, float, float]
    """Forward, left, up and turning left; 1 is the greatest."""
    arrow: tuple[float, float]
    color: Rgb


_SLANTED = math.sqrt(0.5)
"""Components of a diagonal arrow."""
PARTS = {
    "turn left": Part((0.0, 0.0, 0.0, 1.0), (-_SLANTED, _SLANTED), palette.TURN_LEFT),
    "left": Part((0.0, 1.0, 0.0, 0.0), (-1.0, 0.0), palette.LEFT),
    "up": Part((0.0, 0.0, 1.0, 0.0), (0.6, 0.8), palette.UP),
    "forward": Part((1.0, 0.0, 0.0, 0.0), (0.0, 1.0), palette.FORWARD),
    "back": Part((-1.0, 0.0, 0.0, 0.0), (0.0, -1.0), palette.BACK),
    "down": Part((0.0, 0.0, -1.0, 0.0), (0.6, -0.8), palette.DOWN),
    "right": Part((0.0, -1.0, 0.0, 0.0), (1.0, 0.0), palette.RIGHT),
    "turn right": Part((0.0, 0.0, 0.0, -1.0), (_SLANTED, _SLANTED), palette.TURN_RIGHT),
}
"""By name, from left to right."""


def fields_of(names: tuple[str, ...]) -> dict[str, Any]:
    """Return the fields of `Actions` with some of `PARTS`, which follow from their speeds."""
    parts = [PARTS[name] for name in names]
    number = {part.speeds: i for i, part in enumerate(parts)}
    mirrored = ((ahead, -left, up, -turn) for ahead, left, up, turn in number)
    opposite = ((-ahead, -left, -up, -turn) for ahead, left, up, turn in number)
    return {
        "names": names,
        "mirrored": tuple(number[speeds] for speeds in mirrored),
        "opposite": tuple(number.get(speeds, i) for i, speeds in enumerate(opposite)),
        "left": names.index("left" if "left" in names else "turn left"),
        "order": tuple(names.index(name) for name in PARTS if name in names),
        "arrows": tuple(part.arrow for part in parts),
        "colors": tuple(part.color for part in parts),
    }


class Move(enum.IntEnum):
    """The three moves of the chapter's section 4."""

    FORWARD = 0
    LEFT = 1
    RIGHT = 2


MOVES = DiscreteActions(**fields_of(("forward", "left", "right")))
"""The moves as a set of actions; nothing undoes a move forward."""
UP, DOWN = 3, 4
"""Further moves of `MOVES_3D`."""
MOVES_3D = DiscreteActions(**fields_of((*MOVES.names, "up", "down")))
"""The chapter's moves, up and down."""
_TURNS = ("turn left", "turn right")
MOVE_SETS = {
    "moves": MOVES,
    "moves_3d": MOVES_3D,
    "moves_turning": DiscreteActions(**fields_of(("forward", *_TURNS))),
    "moves_full": DiscreteActions(**fields_of((*MOVES_3D.names, "back", *_TURNS))),
}
"""Sets of moves by `ActionSettings.kind`."""
