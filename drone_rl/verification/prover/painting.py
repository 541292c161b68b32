"""From what pixels may show of each cube to bounds on what the network sees."""

from collections.abc import Callable, Sequence

import torch
from torch import Tensor

from drone_rl.verification.prover.silhouettes import NOTHING

Transform = Callable[[Tensor], Tensor]

Part = tuple[slice, slice]
"""Rows and columns of a picture."""
_FACES = 4


class Painter:
    """Paints cubes over each other, the nearer one in front, before an even background."""

    def __init__(self, background: Tensor, faces: Tensor, rest: Transform | None = None) -> None:
        """Notes the brightness of everything.

        Args:
            background: Of what is seen where no cube is. Shape: (height, width), float32.
            faces: Of a cube's front, left and right side. Shape: (3,), float32.
            rest: What becomes of a picture (N, 1, height, width) before the network sees it;
                brighter pixels must not make anything darker. Nothing by default.
        """
        self._background = background
        self._rest = rest
        inf = torch.inf
        bits = torch.arange(2**_FACES)[:, None] >> torch.arange(1, _FACES) & 1 == 1
        self._shades = torch.cat([faces.new_zeros(1), faces])
        self._lowest = torch.where(bits, faces, inf).min(-1).values
        self._highest = torch.where(bits, faces, -inf).max(-1).values
        is_open = torch.arange(2**_FACES) >> NOTHING & 1 == 1
        self._shut = torch.where(is_open, 0.0, inf)
        """Added to what stands behind: it counts where the cube may leave it open."""

    def paint(
        self, cubes: Sequence[tuple[Part, Tensor, Tensor]], num_pictures: int
    ) -> tuple[Tensor, Tensor]:
        """Bounds on pictures.

        Args:
            cubes: Of each, the nearest first: rows and columns outside which nothing is seen of
                it; masks of what pixels may show there in different cases (bit f for face f),
                shape (cases, rows, columns), uint8; which case each picture is, shape (N,).
            num_pictures: N.

        Returns:
            Lower and upper bounds. Shape: (N, height, width).
        """
        lower = self._background.repeat(num_pictures, 1, 1)
        upper = lower.clone()
        for part, masks, case in reversed(cubes):
            index = masks.int()
            shut = self._shut[index].index_select(0, case)
            low, high = lower[:, *part], upper[:, *part]
            low.add_(shut).clamp_max_(self._lowest[index].index_select(0, case))
            high.sub_(shut).clamp_min_(self._highest[index].index_select(0, case))
        return lower, upper

    def paint_one(self, cubes: Sequence[tuple[Part, Tensor]], num_pictures: int) -> Tensor:
        """Pictures of which everything is known.

        Args:
            cubes: Of each, the nearest first: rows and columns outside which nothing is seen of
                it, and what pixels show there, shape (N, rows, columns), uint8.
            num_pictures: N.

        Returns:
            Shape: (N, height, width).
        """
        pictures = self._background.repeat(num_pictures, 1, 1)
        for part, faces in reversed(cubes):
            shade = self._shades[faces.int()]
            behind = pictures[:, *part]
            behind.copy_(torch.where(faces == NOTHING, behind, shade))
        return pictures

    def see(self, pictures: Tensor) -> Tensor:
        """What the network sees. Shape: (N, height, width) to (N, C, H, W)."""
        return pictures[:, None] if self._rest is None else self._rest(pictures[:, None])
