"""Appearance of scenes of any geoms for the kernels: a stub that knows the color of the sky."""

from typing import Any

import warp as wp

from drone_rl.sim.rendering.appearance import Appearance
from drone_rl.sim.rendering.raytrace.light_kernel import Look
from drone_rl.sim.rendering.scene import Scene


class LookEncoder:
    """Encodes a scene's own materials and lights, and appearances that differ from them."""

    def __init__(self, scene: Scene) -> None:
        self._look: Any = Look()
        self._look.sky = wp.array([scene.sky], dtype=wp.vec3, device="cpu")

    def encode(self, appearance: Appearance | None, num_envs: int) -> Look:
        """Return what the kernels need to shade a batch."""
        del appearance, num_envs
        return self._look
