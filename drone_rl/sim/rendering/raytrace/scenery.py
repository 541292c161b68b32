# pyright: reportAttributeAccessIssue=false
# pyright: reportGeneralTypeIssues=false
# (Warp's structures are untyped.)
"""Sky, fog, shadows and textures for the ray tracer's kernels."""

import math
from types import MappingProxyType

import numpy as np
import torch
import warp as wp
from numpy.typing import NDArray
from torch import Tensor

from drone_rl.sim.rendering import textures
from drone_rl.sim.rendering.appearance import Appearance, each_number
from drone_rl.sim.rendering.raytrace import structs
from drone_rl.sim.rendering.scene import Scene

_OPAQUE = math.log(20.0)
"""Air through which 5% of a contrast is left, by its logarithm."""

_KINDS = MappingProxyType({"zenith": wp.vec3})
"""Types of values of several numbers."""
_NONE = np.zeros((1, 3), np.uint8)
"""So that there is one."""


class Sceneries:
    """Makes them; textures are read once."""

    def __init__(self, scene: Scene, device: str) -> None:
        """Notes for whom.

        Args:
            scene: Whose things are covered.
            device: Where they are wanted.
        """
        self._scene, self._device = scene, device
        self._banks: dict[tuple[str, ...], structs.Scenery] = {}

    def of(self, appearance: Appearance, zenith: Tensor) -> structs.Scenery:
        """What worlds look like besides colours and lights.

        Args:
            appearance: Theirs.
            zenith: Colours of the sky overhead. Shape: (num_worlds, 3), from 0 to 1.

        Raises:
            InputError: A texture can't be read.
        """
        count = len(zenith)
        names = tuple({n: 0 for t in appearance.textures.values() for n in t.pictures})
        scenery = self._bank(names)
        texture = torch.full((count, self._scene.model.ngeom), -1, dtype=torch.int32)
        tiles = torch.zeros(texture.shape)
        for meaning, cover in appearance.textures.items():
            geoms = self._scene.geoms(meaning)
            number = torch.tensor([names.index(name) for name in cover.pictures] + [-1])
            chosen = each_number(cover.choice, count).long()
            texture[:, geoms] = number[chosen][:, None].int()
            tiles[:, geoms] = (1.0 / each_number(cover.size, count))[:, None].float()
        fog = math.inf if appearance.fog is None else appearance.fog
        shadows = 0 if appearance.shadows is None else appearance.shadows
        values = {
            "zenith": (zenith * 255).floor().float(),
            "fog": (_OPAQUE / each_number(fog, count)).float(),
            "shadows": each_number(shadows, count).int(),
            "texture": texture,
            "tiles": tiles,
        }
        for name, value in values.items():
            there = value.to(self._device).contiguous()
            setattr(scenery, name, wp.from_torch(there, dtype=_KINDS.get(name)))
        return scenery

    def _bank(self, names: tuple[str, ...]) -> structs.Scenery:
        """One with textures alone, ready to be completed."""
        if names not in self._banks:
            pictures = [textures.load(name) for name in names]
            rows = [textures.levels(picture) for picture in pictures]
            starts = np.cumsum([0, *map(len, rows)])
            made = structs.Scenery()
            made.sides = self._array([len(picture) for picture in pictures], int)
            made.starts = self._array(starts[:-1], int)
            made.texels = self._array(_packed(np.concatenate([*rows, _NONE])), wp.uint32)
            self._banks[names] = made
        kept, made = self._banks[names], structs.Scenery()
        made.sides, made.starts, made.texels = kept.sides, kept.starts, kept.texels
        return made

    def _array(self, values: object, dtype: type) -> wp.array:
        return wp.array(np.array(values), dtype=dtype, device=self._device)


def _packed(colors: NDArray[np.uint8]) -> NDArray[np.uint32]:
    """Bytes of red, green and blue in one number each."""
    return colors.astype(np.uint32) @ np.array([1, 1 << 8, 1 << 16], np.uint32)
