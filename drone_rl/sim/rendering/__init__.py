"""Rendering: views, appearance, and the renderers of simulated cameras."""

from drone_rl.sim.rendering.appearance import Appearance, Distractors, Mounting, Texture
from drone_rl.sim.rendering.devices import check_device
from drone_rl.sim.rendering.raytrace.renderer import Raytracer
from drone_rl.sim.rendering.renderer import Poses, Renderer, RendererFactory, find_renderer
from drone_rl.sim.rendering.scene import Scene
from drone_rl.sim.rendering.view import View

__all__ = [
    "Appearance",
    "Distractors",
    "Mounting",
    "Poses",
    "Raytracer",
    "Renderer",
    "RendererFactory",
    "Scene",
    "Texture",
    "View",
    "check_device",
    "find_renderer",
]
