"""Which renderer draws where nobody asks for one."""

from drone_rl.sim.rendering.raytrace import Raytracer
from drone_rl.sim.rendering.renderer import Renderer
from drone_rl.sim.rendering.scene import Scene


def make_renderer(
    scene: Scene, *, num_worlds: int, num_shards: int | None = None, device: str = "cpu"
) -> Renderer:
    """Makes the fastest one for a device: our own on a CPU, MuJoCo Warp's on a GPU.

    Args:
        scene: What will be drawn.
        num_worlds: See `MakeRenderer`, as for the others.
        num_shards: Threads.
        device: "cpu", "cuda" or "cuda:N".

    Raises:
        InputError: It can't draw the scene, or there is no such device.
    """
    if device == "cpu":
        return Raytracer(scene, num_worlds=num_worlds, num_shards=num_shards)
    from drone_rl.sim.rendering.warp import WarpRenderer

    return WarpRenderer(scene, num_worlds=num_worlds, num_shards=num_shards, device=device)
