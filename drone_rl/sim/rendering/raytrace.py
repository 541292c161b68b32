# pyright: reportCallIssue=false
# pyright: reportAttributeAccessIssue=false
# (Warp's structures are untyped.)
"""Pictures of many worlds at once on a CPU, by a ray tracer of our own: no OpenGL.

MuJoCo Warp's ray tracer draws anything; this one draws what our worlds are made of, simple solids
under distant lights: the same pictures, ten times as fast.
"""

import torch
import warp as wp
from torch import Tensor

from drone_rl.sim.rendering import raytrace_kernel as kernel
from drone_rl.sim.rendering.appearance import Appearance
from drone_rl.sim.rendering.crew import Crew
from drone_rl.sim.rendering.devices import start_warp
from drone_rl.sim.rendering.raytrace_looks import Looks
from drone_rl.sim.rendering.raytrace_scene import (
    Frames,
    check_scene,
    make_camera,
    make_geoms,
    make_rays,
)
from drone_rl.sim.rendering.renderer import Poses
from drone_rl.sim.rendering.scene import Scene
from drone_rl.sim.rendering.view import View
from drone_rl.utils.errors import InputError

_DRAWN = {
    "rgb": kernel.RGB,
    "depth": kernel.DEPTH,
    "segmentation": kernel.SEGMENTATION,
}
"""The kernel's number of each modality."""


class Raytracer:
    """Draws worlds of a scene of planes, boxes, balls, capsules, cylinders and ellipsoids."""

    def __init__(
        self, scene: Scene, *, num_worlds: int, num_shards: int | None = None, device: str = "cpu"
    ) -> None:
        """Notes what will be drawn; the kernel is loaded with the first picture of a view.

        Args:
            scene: What will be drawn.
            num_worlds: About how many worlds are drawn in a call.
            num_shards: Threads; the number of cores by default.
            device: "cpu".

        Raises:
            InputError: The scene or the device is not for it.
        """
        start_warp(device)
        if device != "cpu":
            raise InputError(f"device={device}, but Raytracer draws on a CPU; take WarpRenderer")
        check_scene(scene)
        self.scene = scene
        self._frames = Frames(scene)
        self._looks = Looks(scene)
        self._crew = Crew(num_worlds, num_shards)
        self._views: dict[View, _Prepared] = {}

    def prepare(self, view: View) -> None:
        """Loads the kernel and makes what it needs for a view.

        Raises:
            InputError: The scene has no such camera, or the modality is unknown.
        """
        if view not in self._views:
            view.check_modality(self, _DRAWN)
            self._views[view] = _Prepared(self.scene, self._frames, view, self._crew.size)
            wp.load_module(kernel, device="cpu")

    def render(self, view: View, poses: Poses, appearance: Appearance | None = None) -> Tensor:
        """Draws worlds; see `Renderer.render`."""
        self.prepare(view)
        prepared, count = self._views[view], len(poses)
        world = poses.props.new_zeros(count, 1, 3)
        places = torch.cat([world, poses.position[:, None], poses.props], 1).float()
        attitudes = poses.attitude.float().contiguous()
        looks = self._looks.of(appearance, count)
        moved = [
            wp.from_torch(places, dtype=wp.vec3, return_ctype=True),
            wp.from_torch(attitudes, dtype=wp.vec4, return_ctype=True),
        ]
        what = _DRAWN[view.modality]
        sky = prepared.sky(self._looks.sky(appearance, count))
        pictures = view.new_pictures(count)
        rows = pictures.flatten(1)
        written = [wp.from_torch(rows) if i == what else None for i in _DRAWN.values()]

        def work(member: int, first: int, last: int) -> None:
            rows[first:last] = sky if len(sky) == 1 else sky[first:last]
            given = [first, last, what, *prepared.inputs, *moved, looks]
            inputs = [*given, prepared.nearest[member], *written]
            wp.launch(kernel.draw, 1, inputs=inputs, device="cpu")

        self._crew.share_out(0, count, work)
        return pictures

    def close(self) -> None:
        """Ends the threads."""
        self._crew.close()


class _Prepared:
    """What the kernel needs for one view."""

    def __init__(self, scene: Scene, frames: Frames, view: View, members: int) -> None:
        camera = make_camera(scene, frames, view)
        directions = make_rays(camera).reshape(-1, 3)
        rays = wp.array(directions, dtype=wp.vec3, device="cpu")
        self.inputs = (camera, rays, make_geoms(scene, frames, view.show_drone))
        self._modality, self._pixels = view.modality, view.height * view.width
        self.nearest = [wp.empty(self._pixels, dtype=float, device="cpu") for _ in range(members)]

    def sky(self, color: Tensor) -> Tensor:
        """Pictures without anything in them.

        Args:
            color: Shape (1 or num_worlds, 3), uint8.

        Returns:
            Shape: (1 or num_worlds, height * width * channels).
        """
        if self._modality == "rgb":
            return color.repeat(1, self._pixels)
        return torch.full((1, self._pixels), 0 if self._modality == "depth" else -1)
