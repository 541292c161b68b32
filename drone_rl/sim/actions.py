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
from typing import Any, NamedTuple, Protocol, TypeVar

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

Wish = TypeVar("Wish", Tensor, NDArray)
"""One wish or many: the last dimension is a wish's own, those before it count wishes."""
Rgb = tuple[int, int, int]
"""Red, green, blue, 0 to 255."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Parts:
    """Parts of a wish, known by number.

    Raises:
        ValueError: A mirror image or opposite is not among them, or not mutual.
    """

    names: tuple[str, ...]
    """What people call each."""
    mirrored: tuple[int, ...]
    """What each becomes in a mirror."""
    opposite: tuple[int, ...]
    """What undoes each; itself where nothing does."""
    left: int
    """The one that goes left; its mirror image goes right."""
    order: tuple[int, ...]
    """All of them, from left to right, as they are drawn."""
    arrows: tuple[tuple[float, float], ...]
    """Where each points on a page, to the right and up; length 1, or 0 if it points nowhere."""
    colors: tuple[Rgb, ...]
    """Of each."""

    def __post_init__(self) -> None:
        """Refuses a set that contradicts itself."""
        every = list(range(len(self.names)))
        for name in ("mirrored", "opposite"):
            pairs = getattr(self, name)
            if sorted(pairs) != every or [pairs[pairs[i]] for i in every] != every:
                raise ValueError(f"{name}={pairs} must pair actions, or an action with itself")
        if sorted(self.order) != every:
            raise ValueError(f"order={self.order} must name every action once")
        if not len(self.arrows) == len(self.colors) == len(every):
            raise ValueError(f"give an arrow and a colour to each of {len(every)} actions")
        if self.mirrored[self.left] == self.left:
            raise ValueError(f"left={self.left} is its own mirror image; give one that turns")

    def __len__(self) -> int:
        """Returns how many there are."""
        return len(self.names)

    @property
    def right(self) -> int:
        """The one that goes right."""
        return self.mirrored[self.left]

    @property
    def lefts(self) -> tuple[int, ...]:
        """All that lead to the left; their mirror images lead to the right."""
        return (self.left,)

    def chosen(self, wish: Tensor) -> Tensor:
        """The part with the greatest share."""
        return wish.argmax(-1)

    def mirror(self, wish: Wish) -> Wish:
        """Each part's share becomes that of its mirror image."""
        return wish[..., list(self.mirrored)]

    def distance(self, wish: Wish, other: Wish) -> Wish:
        """Total variation: half the sum of the absolute differences."""
        return 0.5 * abs(wish - other).sum(-1)  # pyright: ignore[reportReturnType] (of arrays and tensors)

    def leaning(self, wish: Wish) -> Wish:
        """The share of what leads to the left."""
        return wish[..., list(self.lefts)].sum(-1)  # pyright: ignore[reportReturnType] (of both)

    def opposition(self, wish: NDArray, other: NDArray) -> NDArray:
        """The lesser of the swings to the left and to the right; 0 unless both go one way.

        0 says that both want the same, 1 that one surely goes left and the other surely right.
        """
        swing, rights = wish - other, [self.mirrored[part] for part in self.lefts]
        to_left, to_right = swing[..., list(self.lefts)].sum(-1), -swing[..., rights].sum(-1)
        agreed = np.sign(to_left) == np.sign(to_right)
        least = np.minimum(np.abs(to_left), np.abs(to_right))
        return np.where(agreed, np.sign(to_left) * least, 0.0)

    def undoes(self, part: Tensor, before: Tensor) -> Tensor:
        """Whether a part is the opposite of the one before, and another one."""
        return (part == self._opposite_of(before)) & (part != before)

    def can_be_undone(self, part: Tensor) -> Tensor:
        """Whether a part has an opposite."""
        return self._opposite_of(part) != part

    def turns(self, part: Tensor) -> Tensor:
        """Whether a part's mirror image is another one."""
        return torch.tensor(self.mirrored, device=part.device)[part] != part

    def agrees(self, part: Tensor, other: Tensor) -> Tensor:
        """Whether parts are the same, or lead to the same side. Shape: of both, broadcast."""
        sides = torch.zeros(len(self), dtype=torch.int64)
        for left in self.lefts:
            sides[left], sides[self.mirrored[left]] = 1, -1
        here, there = (sides.to(p.device)[p] for p in (part, other))
        return (part == other) | ((here == there) & (here != 0))

    def _opposite_of(self, part: Tensor) -> Tensor:
        return torch.tensor(self.opposite, device=part.device)[part]

    def as_dict(self) -> dict[str, Any]:
        """As in `explanation.json`."""
        return {
            "names": list(self.names),
            "order": [int(part) for part in self.order],
            "arrows": [list(arrow) for arrow in self.arrows],
            "mirrored": [int(part) for part in self.mirrored],
            "left": int(self.left),
            "colors": [list(color) for color in self.colors],
        }


__all__ = ["DIRECTIONS", "MOVES", "Actions", "DiscreteActions", "Entry", "Move", "Rgb", "Wish"]


class Entry(NamedTuple):
    """Shape, type and bounds of an array, for one environment."""

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
        """Names of the parts of a wish, in its order."""
        ...

    @property
    def order(self) -> tuple[int, ...]:
        """The parts from left to right, as plots show them."""
        ...

    @property
    def entry(self) -> Entry:
        """Shape, type and bounds of one environment's action."""
        ...

    @property
    def num_outputs(self) -> int:
        """Number of the network's outputs."""
        ...

    @property
    def output_names(self) -> tuple[str, ...]:
        """Names of the network's outputs."""
        ...

    def wish(self, outputs: Tensor) -> Tensor:
        """Return the wish of a network's outputs. (*, num_outputs) to (*, len(names))."""
        ...

    def scores(self, outputs: Tensor) -> Tensor:
        """Return unbounded scores with which the shares of parts grow. Shapes as of `wish`."""
        ...

    def greedy(self, outputs: Tensor) -> Tensor:
        """Return the most probable action. (*, num_outputs) to (*), then the entry's."""
        ...

    def chosen(self, wish: Tensor) -> Tensor:
        """Return the part with the largest share. Shape: (*)."""
        ...

    def part(self, action: Tensor) -> Tensor:
        """Return the parts that actions belong to. (*), then the entry's, to (*)."""
        ...

    def always(self, name: str) -> Tensor:
        """Return the full-speed action of a part, by name. Shape: the entry's."""
        ...

    def draw(self, shape: tuple[int, ...], generator: torch.Generator) -> Tensor:
        """Sample uniformly, on the generator's device. Shape: `shape`, then the entry's."""
        ...

    def fields(self) -> dict[str, str]:
        """Return the entries that data sets keep of an action, with descriptions."""
        ...

    def kept(self, action: Tensor) -> dict[str, Tensor]:
        """Return these entries; "actions" are the parts. (T), then the entry's, to (T, *)."""
        ...

    def mirror(self, wish: Wish) -> Wish:
        """Return the mirror image of a wish. Shape kept."""
        ...

    def distance(self, wish: Wish, other: Wish) -> Wish:
        """Return the distance of two wishes, 0 to 1. Shape: (*)."""
        ...

    def leaning(self, wish: Wish) -> Wish:
        """Return the share of parts to the left, 0 to 1. Shape: (*)."""
        ...

    def opposition(self, wish: NDArray, other: NDArray) -> NDArray:
        """How opposed two wishes are, 0 to 1; below 0 where the second leans left. Shape: (*)."""
        ...

    def undoes(self, part: Tensor, before: Tensor) -> Tensor:
        """Return whether a part undoes the one before it. Shape: (*), bool."""
        ...

    def sways(self, kept: Mapping[str, Tensor]) -> Tensor:
        """Return whether actions, as `kept`, are steps of going back and forth. (T,), bool."""
        ...

    def turns(self, part: Tensor) -> Tensor:
        """Return whether a part differs from its mirror image. Shape: (*), bool."""
        ...

    def agrees(self, part: Tensor, other: Tensor) -> Tensor:
        """Return whether parts are equal or lead to the same side. Shape: (*), bool."""
        ...

    def as_dict(self) -> dict[str, Any]:
        """Return what reports need to name and plot them, as plain values."""
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
