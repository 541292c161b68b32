"""Pictures of worlds: what is asked for, how things look, and who draws them."""

from drone_rl.sim.rendering.appearance import Appearance
from drone_rl.sim.rendering.renderer import Poses, Renderer
from drone_rl.sim.rendering.scene import Scene
from drone_rl.sim.rendering.view import View
from drone_rl.sim.rendering.warp import WarpRenderer, check_device

__all__ = [
    "Appearance",
    "Poses",
    "Renderer",
    "Scene",
    "View",
    "WarpRenderer",
    "check_device",
]
