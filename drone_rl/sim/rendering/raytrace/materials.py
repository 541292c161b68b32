# pyright: reportAttributeAccessIssue=false
# pyright: reportGeneralTypeIssues=false
# (MuJoCo's compiled bindings and Warp's structures are untyped.)
"""Colours and lights for the ray tracer's kernels: the scene's, or each world's own."""

import math
from types import MappingProxyType
from typing import Any

import numpy as np
import torch
import warp as wp
from numpy.typing import NDArray
from torch import Tensor

from drone_rl.sim.rendering import textures
from drone_rl.sim.rendering.appearance import Appearance, each, each_number
from drone_rl.sim.rendering.raytrace import structs_kernel
from drone_rl.sim.rendering.scene import Meaning, Scene

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
        self._banks: dict[tuple[str, ...], structs_kernel.Scenery] = {}

    def of(self, appearance: Appearance, zenith: Tensor) -> structs_kernel.Scenery:
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

    def _bank(self, names: tuple[str, ...]) -> structs_kernel.Scenery:
        """One with textures alone, ready to be completed."""
        if names not in self._banks:
            pictures = [textures.load(name) for name in names]
            rows = [textures.levels(picture) for picture in pictures]
            starts = np.cumsum([0, *map(len, rows)])
            made = structs_kernel.Scenery()
            made.sides = self._array([len(picture) for picture in pictures], int)
            made.starts = self._array(starts[:-1], int)
            made.texels = self._array(_packed(np.concatenate([*rows, _NONE])), wp.uint32)
            self._banks[names] = made
        kept, made = self._banks[names], structs_kernel.Scenery()
        made.sides, made.starts, made.texels = kept.sides, kept.starts, kept.texels
        return made

    def _array(self, values: object, dtype: type) -> wp.array:
        return wp.array(np.array(values), dtype=dtype, device=self._device)


def _packed(colors: NDArray[np.uint8]) -> NDArray[np.uint32]:
    """Bytes of red, green and blue in one number each."""
    return colors.astype(np.uint32) @ np.array([1, 1 << 8, 1 << 16], np.uint32)


_LIGHTS = {"ambient": "ambient", "sun": "diffuse", "sun_direction": "direction"}
"""What an appearance's lights are called in the structs."""

_Made = tuple[structs_kernel.Looks, Any]
"""Colours and lights; and a `Scenery`, or none."""


class Looks:
    """How a scene looks, and how worlds look that differ from it."""

    def __init__(self, scene: Scene, device: str) -> None:
        """Notes the scene's colours and lights.

        Args:
            scene: Whose.
            device: Where they are wanted.
        """
        model = scene.model
        self._scene, self._device = scene, device
        stored = {
            "colors": scene.colors[:, :3],
            "ambient": model.light_ambient,
            "diffuse": model.light_diffuse,
            "direction": model.light_dir,
            "sky": scene.sky,
        }
        self._plain = {name: torch.tensor(v)[None].double() for name, v in stored.items()}
        self._made = self._structure(self._plain)
        self._sceneries = Sceneries(scene, device)
        self._last: tuple[Appearance | None, int, _Made] = (None, 1, (self._made, None))

    def of(self, appearance: Appearance | None, num_worlds: int) -> _Made:
        """What worlds look like, and what there is besides flat colours, if anything.

        Args:
            appearance: As in the scene by default; one that was given before is not read again.
            num_worlds: As many as the appearance has.

        Raises:
            InputError: A texture can't be read.
        """
        if appearance is None:
            return self._made, None
        last, count, made = self._last
        if last is not appearance or count != num_worlds:
            made = self._make(appearance, num_worlds)
            self._last = (appearance, num_worlds, made)
        return made

    def _make(self, appearance: Appearance, num_worlds: int) -> _Made:
        values = {
            name: v.repeat(num_worlds, *[1] * (v.dim() - 1)) for name, v in self._plain.items()
        }
        for meaning, color in appearance.colors.items():
            colored = each(color, num_worlds)
            if meaning is Meaning.SKY:
                values["sky"][:] = colored
            else:
                values["colors"][:, self._scene.geoms(meaning)] = colored[:, None]
        if appearance.beside is not None:
            beside = appearance.beside.of(num_worlds)
            values["colors"][:, self._scene.geoms(Meaning.DISTRACTOR)] = beside.colors.double()
        for name, value in appearance.lights(num_worlds).items():
            values[_LIGHTS[name]][:] = value[:, None]
        zenith = values["sky"] if appearance.zenith is None else each(appearance.zenith, num_worlds)
        if appearance.exposure is not None:
            exposure = each_number(appearance.exposure, num_worlds)
            for name in ("ambient", "diffuse"):
                values[name] *= exposure[:, None, None]
            values["sky"] = (values["sky"] * exposure[:, None]).clamp(max=1.0)
            zenith = (zenith * exposure[:, None]).clamp(max=1.0)
        plain = appearance.is_plain
        scenery = None if plain else self._sceneries.of(appearance, zenith)
        return self._structure(values), scenery

    def _structure(self, values: dict[str, Tensor]) -> structs_kernel.Looks:
        made = structs_kernel.Looks()
        values = {**values, "sky": (values["sky"] * 255).to(torch.uint8)}
        for name, value in values.items():
            there = value.to(self._device, torch.float32).contiguous()
            setattr(made, name, wp.from_torch(there, dtype=wp.vec3))
        return made
