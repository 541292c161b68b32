"""Light on what rays hit in scenes of any geoms: a stub with one color and a headlight."""

import warp as wp

from drone_rl.sim.rendering.raytrace.cast_kernel import Hit, World
from drone_rl.sim.rendering.raytrace.structs_kernel import struct

wp.set_module_options({"enable_backward": False, "fuse_fp": False})


@struct
class Look:
    """Materials, textures, lights and sky of a batch of environments."""

    sky: wp.array[wp.vec3]


@wp.func
def shade(look: Look, world: World, hit: Hit, direction: wp.vec3) -> wp.vec3:
    """Return the color of a surface, 0 to 1. `direction` is that of the ray, world frame."""
    facing = wp.max(0.0, -wp.dot(hit.normal, direction))
    return wp.vec3(facing, facing, facing)


@wp.func
def sky(look: Look, env: int, direction: wp.vec3) -> wp.vec3:
    """Return the color, 0 to 1, of a ray that hits nothing. `direction`: world frame."""
    return look.sky[env % look.sky.shape[0]]
