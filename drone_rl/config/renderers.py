"""The renderers that there are, by name: what files and the command line can ask for."""

from typing import Annotated

from drone_rl.utils.schema import OneOf

RENDERERS = {
    "raytrace": "drone_rl.sim.rendering.raytrace.renderer.Raytracer",
    "mujoco_warp": "drone_rl.sim.rendering.mujoco_warp.WarpRenderer",
}
"""Where each is to be imported from: our own of simple solids, and MuJoCo Warp's of anything."""

RendererName = Annotated[str, OneOf(tuple(RENDERERS))]
"""A setting that chooses one."""
