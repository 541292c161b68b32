"""Appearance of scenes of any geoms for the kernels: materials, textures, lights and sky."""

import math
from typing import Any

import mujoco as _mujoco
import numpy as np
import warp as wp

from drone_rl.sim.rendering.appearance import Appearance
from drone_rl.sim.rendering.raytrace import light_kernel as kernel
from drone_rl.sim.rendering.raytrace.scene import Frames
from drone_rl.sim.rendering.raytrace.surfaces import make_surfaces
from drone_rl.sim.rendering.raytrace.texels import make_textures
from drone_rl.sim.rendering.scene import Scene

mujoco: Any = _mujoco
"""MuJoCo's bindings, which are untyped."""
_ALL_AROUND = -2.0
"""Cosine below that of any angle."""


class LookEncoder:
    """Encodes a scene's own materials and lights, and appearances that differ from them."""

    def __init__(self, scene: Scene, frames: Frames, workers: int) -> None:
        """Read a scene for up to `workers` images at the same time."""
        self._look: Any = kernel.Look()
        self._look.lighting = make_lighting(scene, frames, "cpu")
        self._look.surfaces = make_surfaces(scene, "cpu")
        self._look.textures = make_textures(scene, "cpu")
        kind: Any = kernel.PlacedLight
        count = len(self._look.lighting.lights)
        self._look.placed = wp.empty((workers, count), dtype=kind, device="cpu")

    def encode(self, appearance: Appearance | None, num_envs: int) -> kernel.Look:
        """Return what the kernels need to shade a batch."""
        del appearance, num_envs
        return self._look


def make_lighting(scene: Scene, frames: Frames, device: str) -> kernel.Lighting:
    """Return the lights and the skyboxes of a scene, with the headlight first."""
    model = scene.model
    lights, colors = [], []
    head = model.vis.headlight
    if head.active:
        light: Any = kernel.Light()
        light.kind, light.frame = kernel.DIRECTIONAL, kernel.CAMERA_FRAME
        light.direction, light.range = wp.vec3(0.0, 0.0, -1.0), math.inf
        lights.append(light)
        colors.append((head.ambient, head.diffuse, head.specular))
    for i in np.flatnonzero(model.light_active).tolist():
        if model.light_type[i] != mujoco.mjtLightType.mjLIGHT_IMAGE:
            lights.append(_make_light(model, i, frames))
            colors.append((model.light_ambient[i], model.light_diffuse[i], model.light_specular[i]))
    made: Any = kernel.Lighting()
    made.lights = wp.array(lights, dtype=kernel.Light, device=device)
    for number, name in enumerate(("ambient", "diffuse", "specular")):
        values = np.array([color[number] for color in colors], np.float32).reshape(1, -1, 3)
        setattr(made, name, wp.array(values, dtype=wp.vec3, device=device))
    made.shadows = wp.array([1], dtype=int, device=device)
    made.exposure = wp.array([1.0], dtype=float, device=device)
    sky = scene.sky if any(scene.sky) else (-1.0, 0.0, 0.0)
    made.horizon = made.zenith = wp.array([sky], dtype=wp.vec3, device=device)
    skies = np.flatnonzero(model.tex_type == mujoco.mjtTexture.mjTEXTURE_SKYBOX)
    made.skies = wp.array([(int(i), 0) for i in skies], dtype=wp.vec2i, device=device)
    return made


def _make_light(model: Any, number: int, frames: Frames) -> kernel.Light:
    light: Any = kernel.Light()
    frame, position, direction = frames.place_light(number)
    light.kind, light.frame = int(model.light_type[number]), frame
    light.position, light.direction = wp.vec3(position), wp.vec3(direction)
    light.attenuation = wp.vec3(model.light_attenuation[number])
    cutoff = float(model.light_cutoff[number])
    is_spot = light.kind == kernel.SPOT and cutoff <= 90.0
    light.least_cosine = math.cos(math.radians(cutoff)) if is_spot else _ALL_AROUND
    light.exponent = float(model.light_exponent[number])
    is_point = light.kind == kernel.POINT
    light.range = float(model.light_range[number]) if is_point else math.inf
    light.casts = int(model.light_castshadow[number])
    return light
