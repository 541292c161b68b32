"""Images of scenes of any geoms on a CPU: geoms are drawn front to back, then pixels are shaded."""

import warp as wp

from drone_rl.sim.rendering.raytrace import canvas_kernel as canvases
from drone_rl.sim.rendering.raytrace import structs_kernel as structs
from drone_rl.sim.rendering.raytrace.cast_kernel import MESH, Hit, World, complete_hit
from drone_rl.sim.rendering.raytrace.intersection_kernel import PLANE
from drone_rl.sim.rendering.raytrace.light_kernel import Look, Shot, shade, sky, start_image
from drone_rl.sim.rendering.raytrace.projection_kernel import frame_attitude, product, rotation
from drone_rl.sim.rendering.raytrace.shading_kernel import gray_of, to_bytes
from drone_rl.sim.rendering.raytrace.structs_kernel import struct

wp.set_module_options({"enable_backward": False, "fuse_fp": False})


@struct
class TileScratch:
    """Working memory, a row for each worker; see `canvas_kernel.Canvas`."""

    depth: wp.array2d[float]
    owner: wp.array2d[int]
    part: wp.array2d[int]
    farthest: wp.array2d[float]
    is_old: wp.array2d[int]
    geoms: wp.array2d[structs.GeomView]
    """All rendered geoms relative to the camera."""
    order: wp.array2d[int]
    """Those that are in view, the nearest first."""
    least: wp.array2d[float]
    """Least depth of each geom, metres."""
    parts: wp.array2d[wp.vec4i]
    """Pixels in which each geom is drawn."""


@wp.kernel
def render_tiles(
    first: int,
    last: int,
    buffer: int,
    view: structs.ViewArrays,
    world: World,
    look: Look,
    scratch: TileScratch,
    images: structs.Images,
) -> None:
    """Render images from `first` up to, not including, `last`, with row `buffer` of the scratch.

    Launch it with a dimension of 1.
    """
    row = int(first)
    while row < last:
        env = row // view.count
        camera = view.cameras[row % view.cameras.shape[0]]
        turned = frame_attitude(camera.frame, world.poses.attitudes[env])
        eye = world.poses.positions[env, camera.frame] + rotation(turned) @ camera.position
        to_world = rotation(product(turned, camera.attitude))
        canvas = make_canvas(view, camera, scratch, buffer)
        draw(canvas, world, env, eye, to_world, scratch, buffer)
        shot = start_image(look, world, view, camera, env, buffer, eye, to_world)
        write(canvas, view, world, look, shot, to_world, scratch.geoms[buffer], images, row)
        row += 1


@wp.func
def make_canvas(
    view: structs.ViewArrays, camera: structs.Camera, scratch: TileScratch, buffer: int
) -> canvases.Canvas:
    """Return the canvas of a camera's image, in a row of the scratch."""
    canvas = canvases.Canvas()
    canvas.width = view.width
    canvas.height = view.height
    canvas.across = (view.width + 7) // 8
    canvas.down = (view.height + 7) // 8
    canvas.x0 = 0.5 * float(view.width) - 0.5
    canvas.y0 = 0.5 * float(view.height) - 0.5
    canvas.x_scale = 0.5 * float(view.width) / camera.half_width
    canvas.y_scale = 0.5 * float(view.height) / camera.half_height
    canvas.far = view.far
    canvas.depth = scratch.depth[buffer]
    canvas.owner = scratch.owner[buffer]
    canvas.part = scratch.part[buffer]
    canvas.farthest = scratch.farthest[buffer]
    canvas.is_old = scratch.is_old[buffer]
    return canvas


@wp.func
def draw(
    canvas: canvases.Canvas,
    world: World,
    env: int,
    eye: wp.vec3,
    to_world: wp.mat33,
    scratch: TileScratch,
    buffer: int,
) -> None:
    """Draw all geoms, those with the least depth first.

    `eye` is the camera's position; `to_world` rotates from its frame.
    """
    canvases.clear(canvas)
    geoms, order = scratch.geoms[buffer], scratch.order[buffer]
    least, parts = scratch.least[buffer], scratch.parts[buffer]
    count = int(0)
    geom = int(0)
    while geom < world.geoms.kind.shape[0]:
        seen = view_geom(world, env, geom, eye, to_world)
        part = wp.vec4i(0, canvas.width - 1, 0, canvas.height - 1)
        least[geom] = 0.0
        if seen.kind != PLANE:
            part = canvases.bounds(canvas, seen)
            least[geom] = canvases.least_depth(canvas, seen)
        geoms[geom] = seen
        parts[geom] = part
        if part[0] <= part[1] and part[2] <= part[3]:
            order[count] = geom
            count += 1
        geom += 1
    canvases.sort(order, least, count)
    i = int(0)
    while i < count:
        number = order[i]
        if geoms[number].kind == MESH:
            mesh = world.mesh[number]
            canvases.draw_mesh(canvas, world.triangles, mesh, geoms[number], number, parts[number])
        else:
            canvases.draw_solid(canvas, geoms[number], number, parts[number], least[number])
        i += 1


@wp.func
def view_geom(
    world: World, env: int, geom: int, eye: wp.vec3, to_world: wp.mat33
) -> structs.GeomView:
    """Return a rendered geom relative to a camera."""
    geoms = world.geoms
    frame = geoms.frame[geom]
    turned = frame_attitude(frame, world.poses.attitudes[env])
    place = world.poses.positions[env, frame] + rotation(turned) @ geoms.position[geom]
    made = structs.GeomView()
    made.kind = geoms.kind[geom]
    made.number = geoms.number[geom]
    made.size = geoms.size[geom]
    made.reach = geoms.reach[geom]
    if world.poses.scales:
        made.size *= world.poses.scales[env, frame]
        made.reach *= world.poses.scales[env, frame]
    made.axes = rotation(product(turned, geoms.attitude[geom]))
    back = wp.transpose(made.axes)
    made.eye = back @ (eye - place)
    made.into = back @ to_world
    return made


@wp.func
def write(
    canvas: canvases.Canvas,
    view: structs.ViewArrays,
    world: World,
    look: Look,
    shot: Shot,
    to_world: wp.mat33,
    geoms: wp.array[structs.GeomView],
    images: structs.Images,
    row: int,
) -> None:
    """Write the image `row` from a canvas."""
    pixel = int(0)
    y = int(0)
    while y < canvas.height:
        x = int(0)
        while x < canvas.width:
            at = 64 * ((y >> 3) * canvas.across + (x >> 3)) + 8 * (y & 7) + (x & 7)
            ray = wp.vec3(
                (float(x) - canvas.x0) / canvas.x_scale,
                (canvas.y0 - float(y)) / canvas.y_scale,
                -1.0,
            )
            cosine = 1.0 / wp.length(ray)
            ray *= cosine
            hit = Hit()
            hit.env = shot.env
            hit.geom = structs.NO_GEOM
            owner = canvas.owner[at]
            direction = to_world @ ray
            if owner != structs.NO_GEOM:
                seen = geoms[owner]
                hit.geom = seen.number
                hit.distance = canvas.depth[at] / cosine
                hit.point = shot.position + hit.distance * direction
                hit = complete_hit(
                    hit,
                    world,
                    seen.kind,
                    seen.size,
                    seen.axes,
                    world.mesh[owner],
                    canvas.part[at],
                    seen.eye,
                    seen.into @ ray,
                )
            write_pixel(view, images, row, pixel, cosine, direction, world, look, hit, shot)
            pixel += 1
            x += 1
        y += 1


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
    shot: Shot,
) -> None:
    """Write all modalities of a pixel. `cosine` is that of its ray to the camera's axis."""
    what = view.what
    if (what & (structs.RGB | structs.GRAY)) != 0:
        color = _color(look, world, hit, direction, shot)
        if (what & structs.RGB) != 0:
            images.rgb[row, pixel] = color
        if (what & structs.GRAY) != 0:
            images.gray[row, pixel] = gray_of(color)
    write_geometry(images, what, row, pixel, cosine, hit)


@wp.func
def _color(look: Look, world: World, hit: Hit, direction: wp.vec3, shot: Shot) -> wp.vec3ub:
    shown = wp.vec3()
    if hit.geom == structs.NO_GEOM:
        shown = sky(look, direction, shot)
    else:
        shown = shade(look, world, hit, direction, shot)
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
