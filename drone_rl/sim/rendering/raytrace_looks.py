# pyright: reportAttributeAccessIssue=false
# pyright: reportGeneralTypeIssues=false
# (MuJoCo's compiled bindings and Warp's structures are untyped.)
"""Colours and lights for the ray tracer's kernel: the scene's, or each world's own."""

import torch
import warp as wp
from torch import Tensor

from drone_rl.sim.meaning import Meaning
from drone_rl.sim.rendering import raytrace_kernel as kernel
from drone_rl.sim.rendering.appearance import Appearance, each
from drone_rl.sim.rendering.scene import Scene

_LIGHTS = {"ambient": "ambient", "sun": "diffuse", "sun_direction": "direction"}
"""What an appearance's lights are called in the kernel."""


class Looks:
    """How a scene looks, and how worlds look that differ from it."""

    def __init__(self, scene: Scene) -> None:
        """Notes the scene's colours and lights."""
        model = scene.model
        self._scene = scene
        stored = {
            "colors": model.geom_rgba[:, :3],
            "ambient": model.light_ambient,
            "diffuse": model.light_diffuse,
            "direction": model.light_dir,
        }
        self._plain = {name: torch.tensor(v[None]).double() for name, v in stored.items()}
        self._made = self._structure(self._plain)
        self._sky = _as_bytes(torch.tensor([scene.sky]))

    def of(self, appearance: Appearance | None, num_worlds: int) -> kernel.Looks:
        """What worlds look like.

        Args:
            appearance: As in the scene by default.
            num_worlds: As many as the appearance has.
        """
        if appearance is None:
            return self._made
        values = {name: value.repeat(num_worlds, 1, 1) for name, value in self._plain.items()}
        for meaning, color in appearance.colors.items():
            if meaning is not Meaning.SKY:
                values["colors"][:, self._scene.geoms(meaning)] = each(color, num_worlds)[:, None]
        for name, value in appearance.lights(num_worlds).items():
            values[_LIGHTS[name]][:] = value[:, None]
        return self._structure(values)

    def sky(self, appearance: Appearance | None, num_worlds: int) -> Tensor:
        """Its colour in the pictures of worlds. Shape: (num_worlds or 1, 3), uint8."""
        color = None if appearance is None else appearance.colors.get(Meaning.SKY)
        return self._sky if color is None else _as_bytes(each(color, num_worlds))

    @staticmethod
    def _structure(values: dict[str, Tensor]) -> kernel.Looks:
        made = kernel.Looks()
        for name, value in values.items():
            setattr(made, name, wp.from_torch(value.float().contiguous(), dtype=wp.vec3))
        return made


def _as_bytes(color: Tensor) -> Tensor:
    return (color * 255).to(torch.uint8)
