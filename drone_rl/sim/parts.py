"""The parts of a wish: what each is called, its mirror image, how it is drawn, how wishes compare.

A wish gives each part a share; the shares add up to 1.
"""

import dataclasses
from typing import Any, TypeVar

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
