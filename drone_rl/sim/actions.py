"""What a policy can do: the names of its actions, their mirror images, and how far they lie apart.

A network's outputs become a *wish*: of discrete actions, the probability of each. Whoever compares
policies compares wishes, by the functions that stand here, and need not know how many actions there
are nor that they are discrete.
"""

import dataclasses
import enum
from typing import Any, NamedTuple, Protocol, TypeVar

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

Wish = TypeVar("Wish", Tensor, NDArray)
"""One wish or many: the last dimension is a wish's own, those before it count wishes."""
Rgb = tuple[int, int, int]
"""Red, green, blue, 0 to 255."""


class Entry(NamedTuple):
    """One world's share of an array: its shape, type, and bounds where it has any."""

    shape: tuple[int, ...]
    dtype: torch.dtype
    low: float | None = None
    high: float | None = None


class Actions(Protocol):
    """A set of actions. Wishes may be tensors or NumPy arrays."""

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

    def wish(self, outputs: Tensor) -> Tensor:
        """What a network's outputs ask for. Shapes: (*, len(names)) both."""
        ...

    def chosen(self, wish: Tensor) -> Tensor:
        """The action that is wished for most. Shape: (*), then the entry's."""
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

    def undoes(self, action: Tensor, before: Tensor) -> Tensor:
        """Whether an action undoes the one before it. Shape: (*), bool."""
        ...

    def can_be_undone(self, action: Tensor) -> Tensor:
        """Whether any action undoes these; going back and forth is made of such. Shape: (*)."""
        ...

    def turns(self, action: Tensor) -> Tensor:
        """Whether an action is another one in a mirror. Shape: (*), bool."""
        ...

    def as_dict(self) -> dict[str, Any]:
        """All that a report needs to name and draw them, as plain values."""
        ...


@dataclasses.dataclass(frozen=True, kw_only=True)
class DiscreteActions:
    """A few actions, known by number; a wish is the probability of each.

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
    def entry(self) -> Entry:
        """One world's action: a number."""
        return Entry((), torch.int64, 0, len(self) - 1)

    def wish(self, outputs: Tensor) -> Tensor:
        """Probabilities of logits (Eq. 9)."""
        return outputs.softmax(-1)

    def chosen(self, wish: Tensor) -> Tensor:
        """The most probable action."""
        return wish.argmax(-1)

    def mirror(self, wish: Wish) -> Wish:
        """Each action's probability becomes that of its mirror image."""
        return wish[..., list(self.mirrored)]

    def distance(self, wish: Wish, other: Wish) -> Wish:
        """Total variation: half the sum of the absolute differences."""
        return 0.5 * abs(wish - other).sum(-1)  # pyright: ignore[reportReturnType] (of arrays and tensors)

    def leaning(self, wish: Wish) -> Wish:
        """The probability of the action that goes left."""
        return wish[..., self.left]

    def opposition(self, wish: NDArray, other: NDArray) -> NDArray:
        """The lesser of the swings to the left and to the right; 0 unless both go one way.

        0 says that both want the same, 1 that one surely goes left and the other surely right.
        """
        swing = wish - other
        to_left, to_right = swing[..., self.left], -swing[..., self.right]
        agreed = np.sign(to_left) == np.sign(to_right)
        least = np.minimum(np.abs(to_left), np.abs(to_right))
        return np.where(agreed, np.sign(to_left) * least, 0.0)

    def undoes(self, action: Tensor, before: Tensor) -> Tensor:
        """Whether an action is the opposite of the one before, and another one."""
        return (action == self._opposite_of(before)) & (action != before)

    def can_be_undone(self, action: Tensor) -> Tensor:
        """Whether an action has an opposite."""
        return self._opposite_of(action) != action

    def turns(self, action: Tensor) -> Tensor:
        """Whether an action's mirror image is another one."""
        return torch.tensor(self.mirrored, device=action.device)[action] != action

    def _opposite_of(self, action: Tensor) -> Tensor:
        return torch.tensor(self.opposite, device=action.device)[action]

    def as_dict(self) -> dict[str, Any]:
        """As in `explanation.json`."""
        return {
            "names": list(self.names),
            "order": [int(action) for action in self.order],
            "arrows": [list(arrow) for arrow in self.arrows],
            "mirrored": [int(action) for action in self.mirrored],
            "left": int(self.left),
            "colors": [list(color) for color in self.colors],
        }


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
