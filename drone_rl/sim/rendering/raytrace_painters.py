# pyright: reportGeneralTypeIssues=false
# pyright: reportArgumentType=false
# pyright: reportCallIssue=false
# pyright: reportAttributeAccessIssue=false
# (Warp's structures are untyped.)
"""Who runs the ray tracer's kernels: the cores of a CPU, a share of the pictures each, or a GPU."""

import warp as wp

from drone_rl.sim.rendering import raytrace_kernel, raytrace_pixels
from drone_rl.sim.rendering import raytrace_structs as structs
from drone_rl.sim.rendering.crew import Crew


class CorePainter:
    """Draws a picture at a time on each core."""

    def __init__(self, num_worlds: int, num_shards: int | None) -> None:
        """Starts the threads; see `Raytracer`."""
        self._crew = Crew(num_worlds, num_shards)
        self._desks: dict[tuple[int, int], raytrace_kernel.Desk] = {}

    def load(self) -> None:
        """Compiles the kernel or takes it from the cache."""
        wp.load_module(raytrace_kernel, device="cpu")

    def paint(
        self,
        count: int,
        view: structs.View,
        geoms: structs.Geoms,
        poses: structs.Poses,
        looks: structs.Looks,
        pictures: structs.Pictures,
    ) -> None:
        """Draws pictures.

        Args:
            count: How many: one for each world and camera.
            view: What is asked for.
            geoms: What is drawn.
            poses: Where it is.
            looks: Colours and light.
            pictures: To draw into.
        """
        size = (view.height * view.width, len(geoms.kind))
        if size not in self._desks:
            self._desks[size] = self._desk(*size)
        desk = self._desks[size]
        given = [view, geoms, poses, looks, desk, pictures]

        def work(member: int, first: int, last: int) -> None:
            inputs = [first, last, member, *given]
            wp.launch(raytrace_kernel.draw, 1, inputs=inputs, device="cpu")

        self._crew.share_out(0, count, work)

    def close(self) -> None:
        """Ends the threads."""
        self._crew.close()

    def _desk(self, pixels: int, geoms: int) -> raytrace_kernel.Desk:
        desk, size = raytrace_kernel.Desk(), self._crew.size
        desk.nearest = wp.empty((size, pixels), dtype=float, device="cpu")
        desk.owner = wp.empty((size, pixels), dtype=int, device="cpu")
        desk.sights = wp.empty((size, geoms), dtype=structs.Sight, device="cpu")
        return desk


class GpuPainter:
    """Draws all pixels at once, a thread each."""

    def __init__(self, device: str) -> None:
        """Takes the GPU, "cuda" or "cuda:N"; a CPU does, too, but slowly."""
        self._device = device

    def load(self) -> None:
        """See `CorePainter`."""
        wp.load_module(raytrace_pixels, device=self._device)

    def paint(
        self,
        count: int,
        view: structs.View,
        geoms: structs.Geoms,
        poses: structs.Poses,
        looks: structs.Looks,
        pictures: structs.Pictures,
    ) -> None:
        """See `CorePainter`."""
        size = (count, len(geoms.kind))
        sights = wp.empty(size, dtype=structs.Sight, device=self._device)
        aimed = [view, geoms, poses, sights]
        wp.launch(raytrace_pixels.aim, size, inputs=aimed, device=self._device)
        drawn = [view, sights, looks, pictures]
        size = (count, view.height * view.width)
        wp.launch(raytrace_pixels.draw_pixels, size, inputs=drawn, device=self._device)

    def close(self) -> None:
        """Ends nothing: there are no threads."""
