"""Kernels that cast single rays."""

import warp as wp

from drone_rl.sim.rendering.raytrace import (
    cast_kernel,
    light_kernel,
    shadows_kernel,
    tiles_kernel,
)

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
    shadows: shadows_kernel.Shadows,
    origin: wp.vec3,
    ends: wp.array[wp.vec3],
    lights: wp.array[light_kernel.PlacedLight],
    blocked: wp.array[int],
) -> None:
    """Write whether a geom is between a point and each of some ends, with one thread."""
    identity = wp.identity(n=3, dtype=float)
    for geom in range(world.geoms.kind.shape[0]):
        shadows.geoms[geom] = tiles_kernel.view_geom(world, 0, geom, origin, identity)
    shadows_kernel.start_shadows(shadows, world.geoms.kind.shape[0])
    shot = light_kernel.Shot()
    shot.position = origin
    shot.lights = lights
    for ray in range(ends.shape[0]):
        shot.lights[0].position = ends[ray]
        shadows_kernel.start_block(shadows, 0)
        normal = wp.normalize(ends[ray] - origin)
        shadows_kernel.set_point(shadows, 0, 0, wp.vec3(), normal, 0.0)
        blocked[ray] = int(shadows_kernel.is_in_shadow(world, shadows, 0, 0, shot, 0))
