"""What a policy can do: the names of its actions, their mirror images, and how far they lie apart.

A network's outputs become a *wish*: what is asked for, as shares of named *parts* that add up to
1. Of discrete actions the parts are the actions, and a share is an action's probability; continuous
ones are of a kind each, such as "left", and a share is the probability of that kind. Whoever
compares policies compares wishes, by the functions that stand here, and need not know how many
actions there are nor whether they are discrete.
"""

import dataclasses
import enum
from collections.abc import Mapping
from typing import Any, NamedTuple, Protocol

import torch
from numpy.typing import NDArray
from torch import Tensor

from drone_rl.sim.parts import Parts, Rgb, Wish

__all__ = ["DIRECTIONS", "MOVES", "Actions", "DiscreteActions", "Entry", "Move", "Rgb", "Wish"]


class Entry(NamedTuple):
    """One world's share of an array: its shape, type, and bounds where it has any."""

    shape: tuple[int, ...]
    dtype: torch.dtype
    low: float | None = None
    high: float | None = None


class Actions(Protocol):
    """A set of actions. Wishes may be tensors or NumPy arrays.

    An *action* is what dynamics take, shaped as `entry` says; a *part* is a number, int64.
    """

    @property
    def names(self) -> tuple[str, ...]:
        """What people call the parts of a wish, in its order."""
        ...

    @property
    def order(self) -> tuple[int, ...]:
        """The parts from left to right, as they are drawn."""
        ...

    @property
    def entry(self) -> Entry:
        """One world's action."""
        ...

    @property
    def num_outputs(self) -> int:
        """How many numbers a network gives."""
        ...

    @property
    def output_names(self) -> tuple[str, ...]:
        """What each of them is for."""
        ...

    def wish(self, outputs: Tensor) -> Tensor:
        """What a network's outputs ask for. Shapes: (*, num_outputs), (*, len(names))."""
        ...

    def scores(self, outputs: Tensor) -> Tensor:
        """A number that each part's share grows with, without bounds. Shapes as of `wish`."""
        ...

    def greedy(self, outputs: Tensor) -> Tensor:
        """The action of who draws nothing. Shapes: (*, num_outputs); (*), then the entry's."""
        ...

    def chosen(self, wish: Tensor) -> Tensor:
        """The part that is wished for most. Shape: (*)."""
        ...

    def part(self, action: Tensor) -> Tensor:
        """What part actions are. Shapes: (*), then the entry's; (*)."""
        ...

    def always(self, name: str) -> Tensor:
        """The action that is that part, and that as much as can be. Shape: the entry's."""
        ...

    def draw(self, shape: tuple[int, ...], generator: torch.Generator) -> Tensor:
        """Actions, all alike probable, on the generator's device. Shape: `shape`, the entry's."""
        ...

    def fields(self) -> dict[str, str]:
        """What is kept of an action, and what that means, in words."""
        ...

    def kept(self, action: Tensor) -> dict[str, Tensor]:
        """These of actions. "actions" are the parts. Shapes: (T), then the entry's; (T, *)."""
        ...

    def mirror(self, wish: Wish) -> Wish:
        """The same wish in a world where left is right. Shape kept."""
        ...

    def distance(self, wish: Wish, other: Wish) -> Wish:
        """How far two wishes lie apart, 0 to 1. Shape: (*)."""
        ...

    def leaning(self, wish: Wish) -> Wish:
        """How much a wish asks for the left, 0 to 1. Shape: (*)."""
        ...

    def opposition(self, wish: NDArray, other: NDArray) -> NDArray:
        """How opposed two wishes are, 0 to 1; below 0 where the second leans left. Shape: (*)."""
        ...

    def undoes(self, part: Tensor, before: Tensor) -> Tensor:
        """Whether a part undoes the one before it. Shape: (*), bool."""
        ...

    def sways(self, kept: Mapping[str, Tensor]) -> Tensor:
        """Whether actions, as `kept`, can be undone and lead nowhere. Shape: (T,), bool.

        Going back and forth is made of such.
        """
        ...

    def turns(self, part: Tensor) -> Tensor:
        """Whether a part is another one in a mirror. Shape: (*), bool."""
        ...

    def agrees(self, part: Tensor, other: Tensor) -> Tensor:
        """Whether parts are the same, or lead to the same side. Shape: (*), bool."""
        ...

    def as_dict(self) -> dict[str, Any]:
        """All that a report needs to name and draw them, as plain values."""
        ...


@dataclasses.dataclass(frozen=True, kw_only=True)
class DiscreteActions(Parts):
    """A few actions, known by number; a wish is the probability of each."""

    @property
    def entry(self) -> Entry:
        """One world's action: a number."""
        return Entry((), torch.int64, 0, len(self) - 1)

    @property
    def num_outputs(self) -> int:
        """A logit for each."""
        return len(self)

    @property
    def output_names(self) -> tuple[str, ...]:
        """The same as the actions'."""
        return self.names

    def wish(self, outputs: Tensor) -> Tensor:
        """Probabilities of logits (Eq. 9)."""
        return outputs.softmax(-1)

    def scores(self, outputs: Tensor) -> Tensor:
        """The logits."""
        return outputs

    def greedy(self, outputs: Tensor) -> Tensor:
        """The most probable action."""
        return outputs.argmax(-1)

    def part(self, action: Tensor) -> Tensor:
        """The action itself."""
        return action

    def always(self, name: str) -> Tensor:
        """That action."""
        return torch.tensor(self.names.index(name))

    def draw(self, shape: tuple[int, ...], generator: torch.Generator) -> Tensor:
        """Whole numbers."""
        return torch.randint(len(self), shape, generator=generator, device=generator.device)

    def fields(self) -> dict[str, str]:
        """Its number."""
        return {"actions": "action taken: " + listed(self.names)}

    def kept(self, action: Tensor) -> dict[str, Tensor]:
        """Its number."""
        return {"actions": action}

    def sways(self, kept: Mapping[str, Tensor]) -> Tensor:
        """Whether they have an opposite."""
        return self.can_be_undone(kept["actions"])


def listed(names: tuple[str, ...]) -> str:
    """Names with their numbers."""
    return ", ".join(f"{number} {name}" for number, name in enumerate(names))


class Move(enum.IntEnum):
    """The three moves of the chapter's section 4."""

    FORWARD = 0
    LEFT = 1
    RIGHT = 2


MOVES = DiscreteActions(
    names=tuple(move.name.lower() for move in Move),
    mirrored=(Move.FORWARD, Move.RIGHT, Move.LEFT),
    opposite=(Move.FORWARD, Move.RIGHT, Move.LEFT),
    left=Move.LEFT,
    order=(Move.LEFT, Move.FORWARD, Move.RIGHT),
    arrows=((0.0, 1.0), (-1.0, 0.0), (1.0, 0.0)),
    colors=((214, 39, 40), (44, 160, 44), (31, 96, 200)),
)
"""As a set of actions; nothing undoes a move forward."""
DIRECTIONS = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, -1.0, 0.0))
"""Unit vector of each of `MOVES`, world frame."""
