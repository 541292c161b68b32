# pyright: reportGeneralTypeIssues=false
# pyright: reportArgumentType=false
# pyright: reportCallIssue=false
# pyright: reportAttributeAccessIssue=false
# (Warp's structures are untyped.)
"""Who runs the ray tracer's kernels: the cores of a CPU, a share of the pictures each, or a GPU.

Kernels are left to the first picture: a training whose flights are one kernel paints none.
"""

import warp as wp

from drone_rl.sim.rendering.crew import Crew
from drone_rl.sim.rendering.devices import loading
from drone_rl.sim.rendering.raytrace import (
    kernel as raytrace_kernel,
)
from drone_rl.sim.rendering.raytrace import (
    pixels as raytrace_pixels,
)
from drone_rl.sim.rendering.raytrace import (
    scenic as raytrace_scenic,
)
from drone_rl.sim.rendering.raytrace import (
    scenic_pixels as raytrace_scenic_pixels,
)
from drone_rl.sim.rendering.raytrace import structs


class CorePainter:
    """Draws a picture at a time on each core."""

    def __init__(self, num_worlds: int, num_shards: int | None) -> None:
        """Starts the threads; see `Raytracer`."""
        self._crew = Crew(num_worlds, num_shards)
        self._desks: dict[tuple[int, int], raytrace_kernel.Desk] = {}

    def paint(
        self,
        count: int,
        view: structs.View,
        geoms: structs.Geoms,
        poses: structs.Poses,
        looks: structs.Looks,
        pictures: structs.Pictures,
        scenery: "structs.Scenery | None" = None,
    ) -> None:
        """Draws pictures.

        Args:
            count: How many: one for each world and camera.
            view: What is asked for.
            geoms: What is drawn.
            poses: Where it is.
            looks: Colours and light.
            pictures: To draw into.
            scenery: What there is besides, if anything.
        """
        size = (view.height * view.width, len(geoms.kind))
        if size not in self._desks:
            self._desks[size] = make_desk(self._crew.size, *size)
        desk = self._desks[size]
        plain = scenery is None
        loading(raytrace_kernel if plain else raytrace_scenic).result()
        draw = raytrace_kernel.draw if plain else raytrace_scenic.draw_scenic
        given = [view, geoms, poses, looks, *([] if plain else [scenery]), desk, pictures]

        def work(member: int, first: int, last: int) -> None:
            inputs = [first, last, member, *given]
            wp.launch(draw, 1, inputs=inputs, device="cpu")

        self._crew.share_out(0, count, work)

    def close(self) -> None:
        """Ends the threads."""
        self._crew.close()


class GpuPainter:
    """Draws all pixels at once, a thread each."""

    def __init__(self, device: str) -> None:
        """Takes the GPU, "cuda" or "cuda:N"; a CPU does, too, but slowly."""
        self._device = device

    def paint(
        self,
        count: int,
        view: structs.View,
        geoms: structs.Geoms,
        poses: structs.Poses,
        looks: structs.Looks,
        pictures: structs.Pictures,
        scenery: "structs.Scenery | None" = None,
    ) -> None:
        """See `CorePainter`."""
        pixels = view.height * view.width
        sights = wp.empty((count, len(geoms.kind)), dtype=structs.Sight, device=self._device)
        aimed = [view, geoms, poses, sights]
        wp.launch(raytrace_pixels.aim, sights.shape, inputs=aimed, device=self._device)
        if scenery is None:
            draw, drawn = raytrace_pixels.draw_pixels, [view, sights, looks, pictures]
        else:
            desk = make_desk(count, pixels, 1, self._device)
            draw = raytrace_scenic_pixels.draw_scenic_pixels
            drawn = [view, poses, sights, looks, scenery, desk, pictures]
        wp.launch(draw, (count, pixels), inputs=drawn, device=self._device)

    def close(self) -> None:
        """Ends nothing: there are no threads."""


def make_desk(
    num_workers: int, pixels: int, geoms: int, device: str = "cpu"
) -> raytrace_kernel.Desk:
    """Room to work.

    Args:
        num_workers: At the same time, a picture each.
        pixels: Of a picture.
        geoms: That are drawn.
        device: Where.
    """
    desk, size = raytrace_kernel.Desk(), (num_workers, pixels)
    desk.nearest = wp.empty(size, dtype=float, device=device)
    desk.owner, desk.dark = (wp.empty(size, dtype=int, device=device) for _ in range(2))
    desk.colors = wp.empty(size, dtype=wp.vec3ub, device=device)
    desk.sights = wp.empty((num_workers, geoms), dtype=structs.Sight, device=device)
    return desk
