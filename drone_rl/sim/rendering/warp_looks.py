"""Colours and lights of MuJoCo Warp's model, of each world its own."""

import mujoco_warp as mjw
import warp as wp
from torch import Tensor

from drone_rl.sim.meaning import Meaning
from drone_rl.sim.rendering.appearance import Appearance, each
from drone_rl.sim.rendering.scene import Scene

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
        for name in ("geom_rgba", *_LIGHTS.values()):
            values = wp.to_torch(getattr(model, name))[:1].repeat(capacity, 1, 1)
            kind = wp.vec4 if name == "geom_rgba" else wp.vec3
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
        for meaning, color in appearance.colors.items():
            if meaning is not Meaning.SKY:
                geoms = self._scene.geoms(meaning)
                self._write("geom_rgba", geoms, each(color, num_worlds))
        for name, value in appearance.lights(num_worlds).items():
            self._write(_LIGHTS[name], slice(None), value)

    def _write(self, name: str, where: list[int] | slice, value: Tensor) -> None:
        values = self._values[name]
        values[: len(value), where, :3] = value[:, None].to(values)
