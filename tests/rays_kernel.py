"""Kernels that cast single rays."""

import warp as wp

from drone_rl.sim.rendering.raytrace import cast_kernel

wp.set_module_options({"enable_backward": False, "fuse_fp": False})


@wp.kernel
def cast_rays(
    world: cast_kernel.World,
    origin: wp.vec3,
    rays: wp.array[wp.vec3],
    hits: wp.array[cast_kernel.Hit],
) -> None:
    """Write what each ray hits."""
    ray = wp.tid()
    hits[ray] = cast_kernel.cast(world, 0, origin, rays[ray], 1000.0)


@wp.kernel
def block_rays(
    world: cast_kernel.World,
    origin: wp.vec3,
    rays: wp.array[wp.vec3],
    distances: wp.array[float],
    blocked: wp.array[int],
) -> None:
    """Write whether each ray is blocked."""
    ray = wp.tid()
    blocked[ray] = int(cast_kernel.is_blocked(world, 0, origin, rays[ray], distances[ray]))
