"""Images of scenes of any geoms on a CPU."""

import warp as wp

from drone_rl.sim.rendering.raytrace import structs_kernel as structs
from drone_rl.sim.rendering.raytrace.cast_kernel import Hit, World, cast
from drone_rl.sim.rendering.raytrace.light_kernel import Look, shade, sky
from drone_rl.sim.rendering.raytrace.projection_kernel import frame_attitude, product, rotation
from drone_rl.sim.rendering.raytrace.shading_kernel import gray_of, to_bytes

wp.set_module_options({"enable_backward": False, "fuse_fp": False})


@wp.kernel
def render_tiles(
    first: int,
    last: int,
    view: structs.ViewArrays,
    world: World,
    look: Look,
    images: structs.Images,
) -> None:
    """Render images from `first` up to, not including, `last`. Launch it with a dimension of 1."""
    row = int(first)
    while row < last:
        env = row // view.count
        camera = view.cameras[row % view.cameras.shape[0]]
        rays = view.rays[row % view.cameras.shape[0]]
        turned = frame_attitude(camera.frame, world.poses.attitudes[env])
        origin = world.poses.positions[env, camera.frame] + rotation(turned) @ camera.position
        to_world = rotation(product(turned, camera.attitude))
        pixel = int(0)
        while pixel < view.height * view.width:
            ray = rays[pixel]
            direction = to_world @ ray
            hit = cast(world, env, origin, direction, view.far / -ray[2])
            write_pixel(view, images, row, pixel, -ray[2], direction, world, look, hit)
            pixel += 1
        row += 1


@wp.func
def write_pixel(
    view: structs.ViewArrays,
    images: structs.Images,
    row: int,
    pixel: int,
    cosine: float,
    direction: wp.vec3,
    world: World,
    look: Look,
    hit: Hit,
) -> None:
    """Write all modalities of a pixel. `cosine` is that of its ray to the camera's axis."""
    what = view.what
    if (what & (structs.RGB | structs.GRAY)) != 0:
        color = _color(look, world, hit, direction)
        if (what & structs.RGB) != 0:
            images.rgb[row, pixel] = color
        if (what & structs.GRAY) != 0:
            images.gray[row, pixel] = gray_of(color)
    write_geometry(images, what, row, pixel, cosine, hit)


@wp.func
def _color(look: Look, world: World, hit: Hit, direction: wp.vec3) -> wp.vec3ub:
    shown = wp.vec3()
    if hit.geom == structs.NO_GEOM:
        shown = sky(look, hit.env, direction)
    else:
        shown = shade(look, world, hit, direction)
    return to_bytes(255.0 * wp.min(wp.max(shown, wp.vec3()), wp.vec3(1.0, 1.0, 1.0)))


@wp.func
def write_geometry(
    images: structs.Images, what: int, row: int, pixel: int, cosine: float, hit: Hit
) -> None:
    """Write all modalities of a pixel but its color; see `write_pixel`."""
    if (what & structs.DEPTH) != 0:
        images.depth[row, pixel] = hit.distance * cosine
    if (what & structs.DISTANCE) != 0:
        images.distance[row, pixel] = hit.distance
    if (what & structs.SEGMENTATION) != 0:
        images.segmentation[row, pixel] = hit.geom
    if (what & structs.NORMALS) != 0:
        images.normals[row, pixel] = hit.face_normal
