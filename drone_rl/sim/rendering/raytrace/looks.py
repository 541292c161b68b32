# pyright: reportAttributeAccessIssue=false
# pyright: reportGeneralTypeIssues=false
# (MuJoCo's compiled bindings and Warp's structures are untyped.)
"""Colours and lights for the ray tracer's kernels: the scene's, or each world's own."""

from typing import Any

import torch
import warp as wp
from torch import Tensor

from drone_rl.sim.rendering.appearance import Appearance, each, each_number
from drone_rl.sim.rendering.raytrace import structs
from drone_rl.sim.rendering.raytrace.scenery import Sceneries
from drone_rl.sim.rendering.scene import Scene
from drone_rl.sim.rendering.semantics import Meaning

_LIGHTS = {"ambient": "ambient", "sun": "diffuse", "sun_direction": "direction"}
"""What an appearance's lights are called in the structs."""

_Made = tuple[structs.Looks, Any]
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

    def _structure(self, values: dict[str, Tensor]) -> structs.Looks:
        made = structs.Looks()
        values = {**values, "sky": (values["sky"] * 255).to(torch.uint8)}
        for name, value in values.items():
            there = value.to(self._device, torch.float32).contiguous()
            setattr(made, name, wp.from_torch(there, dtype=wp.vec3))
        return made
