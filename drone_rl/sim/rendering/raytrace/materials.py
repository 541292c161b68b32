"""Appearance for the ray tracer's kernels: colors, lights, sky, fog, shadows and textures."""

import math
from typing import Any, TypeAlias

import numpy as np
import torch
import warp as wp
from torch import Tensor

from drone_rl.sim.rendering import textures
from drone_rl.sim.rendering.appearance import Appearance, expand_color, expand_scalar
from drone_rl.sim.rendering.raytrace import structs_kernel as structs
from drone_rl.sim.rendering.scene import Scene, SemanticClass

_LIGHTS = {"ambient": "ambient", "sun": "diffuse", "sun_direction": "direction"}
"""The kernels' names of an appearance's lights."""
EXTINCTION = math.log(20.0)
"""Optical depth of air in which 5% of a contrast is left."""
_NO_TEXTURE = np.zeros((1, 3), np.uint8)
"""Keeps the array of texels from being empty."""
_SHIFTS = np.array([1, 1 << 8, 1 << 16], np.uint32)
"""Of red, green and blue bytes in one number."""

_Encoded: TypeAlias = "tuple[structs.Materials, structs.Effects | None]"


class MaterialsEncoder:
    """Encodes a scene's own colors and lights, and appearances that differ from them.

    The last appearance is cached by identity; each set of textures is read once.
    """

    def __init__(self, scene: Scene, device: str) -> None:
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
        self._own = self._materials(self._plain)
        self._textures: dict[tuple[str, ...], dict[str, Any]] = {}
        self._last: tuple[Appearance | None, int, _Encoded] = (None, 1, (self._own, None))

    def encode(self, appearance: Appearance | None, num_envs: int) -> _Encoded:
        """Return materials, and effects if the appearance has any."""
        if appearance is None:
            return self._own, None
        if self._last[0] is not appearance or self._last[1] != num_envs:
            self._last = (appearance, num_envs, self._encode(appearance, num_envs))
        return self._last[2]

    def _encode(self, appearance: Appearance, num_envs: int) -> _Encoded:
        values = {name: v.repeat(num_envs, *[1] * (v.dim() - 1)) for name, v in self._plain.items()}
        for semantic_class, color in appearance.colors.items():
            colored = expand_color(color, num_envs).cpu()
            if semantic_class is SemanticClass.SKY:
                values["sky"][:] = colored
            else:
                values["colors"][:, self._scene.geoms(semantic_class)] = colored[:, None]
        if appearance.distractors is not None:
            colors = appearance.distractors.expand(num_envs).colors.double().cpu()
            values["colors"][:, self._scene.geoms(SemanticClass.DISTRACTOR)] = colors
        for name, value in appearance.lights(num_envs).items():
            values[_LIGHTS[name]][:] = value[:, None]
        zenith = appearance.zenith
        zenith = values["sky"] if zenith is None else expand_color(zenith, num_envs).cpu()
        if appearance.exposure is not None:
            exposure = expand_scalar(appearance.exposure, num_envs).cpu()
            for name in ("ambient", "diffuse"):
                values[name] *= exposure[:, None, None]
            values["sky"] = (values["sky"] * exposure[:, None]).clamp(max=1.0)
            zenith = (zenith * exposure[:, None]).clamp(max=1.0)
        effects = None if appearance.is_plain else self.encode_effects(appearance, zenith)
        return self._materials(values), effects

    def _materials(self, values: dict[str, Tensor]) -> structs.Materials:
        materials: Any = structs.Materials()
        for name, value in {**values, "sky": (values["sky"] * 255).to(torch.uint8)}.items():
            array = value.to(self._device, torch.float32).contiguous()
            setattr(materials, name, wp.from_torch(array, dtype=wp.vec3))
        return materials

    def encode_effects(self, appearance: Appearance, zenith: Tensor) -> structs.Effects:
        """Return the effects; `zenith` holds colors in [0, 1], shape (num_envs, 3)."""
        count = len(zenith)
        names = tuple({n: 0 for t in appearance.textures.values() for n in t.images})
        texture = torch.full((count, self._scene.model.ngeom), -1, dtype=torch.int32)
        tiles = torch.zeros(texture.shape)
        for semantic_class, cover in appearance.textures.items():
            geoms = self._scene.geoms(semantic_class)
            number = torch.tensor([names.index(name) for name in cover.images] + [-1])
            choice = expand_scalar(cover.choice, count).long().cpu()
            texture[:, geoms] = number[choice][:, None].int()
            tiles[:, geoms] = (1.0 / expand_scalar(cover.size, count).cpu())[:, None].float()
        visibility = appearance.fog_visibility
        visibility = math.inf if visibility is None else visibility
        shadows = 0 if appearance.shadows is None else appearance.shadows
        values = {
            "zenith": (zenith * 255).floor().float(),
            "extinction": (EXTINCTION / expand_scalar(visibility, count)).float(),
            "shadows": expand_scalar(shadows, count).int(),
            "texture": texture,
            "tiles": tiles,
        }
        effects: Any = structs.Effects()
        for name, array in self._load(names).items():
            setattr(effects, name, array)
        for name, value in values.items():
            array = value.to(self._device).contiguous()
            dtype = wp.vec3 if name == "zenith" else None
            setattr(effects, name, wp.from_torch(array, dtype=dtype))
        return effects

    def _load(self, names: tuple[str, ...]) -> dict[str, Any]:
        if names not in self._textures:
            images = [textures.load(name) for name in names]
            rows = [textures.levels(image) for image in images]
            texels = np.concatenate([*rows, _NO_TEXTURE]).astype(np.uint32)
            self._textures[names] = {
                "sides": self._array([len(image) for image in images], int),
                "starts": self._array(np.cumsum([0, *map(len, rows)])[:-1], int),
                "texels": self._array(texels @ _SHIFTS, wp.uint32),
            }
        return self._textures[names]

    def _array(self, values: object, dtype: type) -> Any:
        return wp.array(np.array(values), dtype=dtype, device=self._device)
