"""Pictures of worlds: what is asked for, how things look, and who draws them."""

from drone_rl.sim.rendering.appearance import Appearance, Beside, Mounting, Texture
from drone_rl.sim.rendering.devices import check_device
from drone_rl.sim.rendering.raytrace.renderer import Raytracer
from drone_rl.sim.rendering.renderer import MakeRenderer, Poses, Renderer, find_renderer
from drone_rl.sim.rendering.scene import Scene
from drone_rl.sim.rendering.view import View

__all__ = [
    "Appearance",
    "Beside",
    "MakeRenderer",
    "Mounting",
    "Poses",
    "Raytracer",
    "Renderer",
    "Scene",
    "Texture",
    "View",
    "check_device",
    "find_renderer",
]
