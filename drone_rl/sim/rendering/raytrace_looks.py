# pyright: reportAttributeAccessIssue=false
# pyright: reportGeneralTypeIssues=false
# (MuJoCo's compiled bindings and Warp's structures are untyped.)
"""Colours and lights for the ray tracer's kernels: the scene's, or each world's own."""

import torch
import warp as wp
from torch import Tensor

from drone_rl.sim.meaning import Meaning
from drone_rl.sim.rendering import raytrace_structs as structs
from drone_rl.sim.rendering.appearance import Appearance, each
from drone_rl.sim.rendering.scene import Scene

_LIGHTS = {"ambient": "ambient", "sun": "diffuse", "sun_direction": "direction"}
"""What an appearance's lights are called in the structs."""


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

    def of(self, appearance: Appearance | None, num_worlds: int) -> structs.Looks:
        """What worlds look like.

        Args:
            appearance: As in the scene by default.
            num_worlds: As many as the appearance has.
        """
        if appearance is None:
            return self._made
        values = {
            name: v.repeat(num_worlds, *[1] * (v.dim() - 1)) for name, v in self._plain.items()
        }
        for meaning, color in appearance.colors.items():
            colored = each(color, num_worlds)
            if meaning is Meaning.SKY:
                values["sky"][:] = colored
            else:
                values["colors"][:, self._scene.geoms(meaning)] = colored[:, None]
        for name, value in appearance.lights(num_worlds).items():
            values[_LIGHTS[name]][:] = value[:, None]
        return self._structure(values)

    def _structure(self, values: dict[str, Tensor]) -> structs.Looks:
        made = structs.Looks()
        values = {**values, "sky": (values["sky"] * 255).to(torch.uint8)}
        for name, value in values.items():
            there = value.to(self._device, torch.float32).contiguous()
            setattr(made, name, wp.from_torch(there, dtype=wp.vec3))
        return made
