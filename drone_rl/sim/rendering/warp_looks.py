"""Colours and lights of MuJoCo Warp's model, of each world its own."""

import mujoco_warp as mjw
import torch
import warp as wp
from torch import Tensor

from drone_rl.sim.rendering.appearance import Appearance, Beside, each
from drone_rl.sim.rendering.mounting import Mounting, product
from drone_rl.sim.rendering.scene import Scene
from drone_rl.sim.rendering.semantics import Meaning

_KINDS = {
    "geom_rgba": wp.vec4,
    "geom_size": wp.vec3,
    "cam_pos": wp.vec3,
    "cam_quat": wp.quat,
    "light_ambient": wp.vec3,
    "light_diffuse": wp.vec3,
    "light_dir": wp.vec3,
}
"""What may differ from world to world, by its name in the model."""
_LIGHTS = {"ambient": "light_ambient", "sun": "light_diffuse", "sun_direction": "light_dir"}
"""What an appearance's lights are called in the model."""


class Looks:
    """Writes an appearance into a model, and takes it off again for the next call."""

    def __init__(self, scene: Scene, model: mjw.Model, capacity: int) -> None:
        """Gives each world colours and lights of its own, which all are the scene's.

        Args:
            scene: Whose things are coloured.
            model: Changed in place.
            capacity: Number of worlds.
        """
        self._scene = scene
        self._values: dict[str, Tensor] = {}
        for name, kind in _KINDS.items():
            values = wp.to_torch(getattr(model, name))[:1].repeat(capacity, 1, 1)
            setattr(model, name, wp.from_torch(values, dtype=kind))
            self._values[name] = values
        self._plain = {name: values[:1].clone() for name, values in self._values.items()}
        self._is_worn = False

    def wear(self, appearance: Appearance | None, num_worlds: int) -> None:
        """Makes the first worlds look so, and all others as in the scene.

        Args:
            appearance: As in the scene by default.
            num_worlds: As many as the appearance has.
        """
        if self._is_worn:
            for name, values in self._values.items():
                values[:] = self._plain[name]
        self._is_worn = appearance is not None
        if appearance is None:
            return
        self._color(appearance, num_worlds)
        if appearance.beside is not None:
            self._put_beside(appearance.beside.of(num_worlds))
        if appearance.camera is not None:
            self._mount(appearance.camera, num_worlds)

    def _color(self, appearance: Appearance, num_worlds: int) -> None:
        for meaning, color in appearance.colors.items():
            if meaning is not Meaning.SKY:
                geoms = self._scene.geoms(meaning)
                self._write("geom_rgba", geoms, each(color, num_worlds)[:, None])
        for name, value in appearance.lights(num_worlds).items():
            self._write(_LIGHTS[name], slice(None), value[:, None])

    def _put_beside(self, beside: Beside) -> None:
        geoms = self._scene.geoms(Meaning.DISTRACTOR)
        self._write("geom_rgba", geoms, beside.colors)
        edges = self._plain["geom_size"][:, geoms].to(beside.sizes)
        self._write("geom_size", geoms, beside.sizes[..., None] * edges)

    def _mount(self, mounting: Mounting, num_worlds: int) -> None:
        camera = [self._scene.camera(mounting.camera)]
        place, attitude = (self._plain[name][0, camera] for name in ("cam_pos", "cam_quat"))
        moved = place + torch.as_tensor(mounting.offset).to(place)
        turned = product(torch.as_tensor(mounting.turn).to(attitude), attitude)
        for name, value in (("cam_pos", moved), ("cam_quat", turned)):
            self._write(name, camera, value.expand(num_worlds, value.shape[-1])[:, None])

    def _write(self, name: str, where: list[int] | slice, value: Tensor) -> None:
        values = self._values[name]
        values[: len(value), where, : value.shape[-1]] = value.to(values)
