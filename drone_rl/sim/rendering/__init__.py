"""Rendering: views, appearance, and the renderers of simulated cameras."""

from drone_rl.sim.rendering.appearance import Appearance as Appearance
from drone_rl.sim.rendering.appearance import Distractors as Distractors
from drone_rl.sim.rendering.appearance import Mounting as Mounting
from drone_rl.sim.rendering.appearance import Texture as Texture
from drone_rl.sim.rendering.devices import check_device as check_device
from drone_rl.sim.rendering.raytrace.renderer import Raytracer as Raytracer
from drone_rl.sim.rendering.renderer import Poses as Poses
from drone_rl.sim.rendering.renderer import Renderer as Renderer
from drone_rl.sim.rendering.renderer import RendererFactory as RendererFactory
from drone_rl.sim.rendering.renderer import find_renderer as find_renderer
from drone_rl.sim.rendering.scene import Scene as Scene
from drone_rl.sim.rendering.view import View as View
