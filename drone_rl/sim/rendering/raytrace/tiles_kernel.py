"""Images of scenes of any geoms on a CPU: geoms are drawn front to back, then pixels are shaded."""

import warp as wp

from drone_rl.sim.rendering.raytrace import canvas_kernel as canvases
from drone_rl.sim.rendering.raytrace import structs_kernel as structs
from drone_rl.sim.rendering.raytrace.cast_kernel import MESH, Hit, World, complete_hit
from drone_rl.sim.rendering.raytrace.intersection_kernel import PLANE, ROUND, surface_normal
from drone_rl.sim.rendering.raytrace.light_kernel import Look, Shot, finish, sky, start_image
from drone_rl.sim.rendering.raytrace.patches_kernel import Block, shade_patch
from drone_rl.sim.rendering.raytrace.projection_kernel import frame_attitude, product, rotation
from drone_rl.sim.rendering.raytrace.shade_kernel import (
    OPAQUE,
    Point,
    Surface,
    add_casting,
    find_light,
    make_surface,
    reach_patch,
    sample_surface,
    shade,
    start_face,
)
from drone_rl.sim.rendering.raytrace.shading_kernel import BLUE, GREEN, RED
from drone_rl.sim.rendering.raytrace.shadows_kernel import (
    PIXELS,
    Shadows,
    set_point,
    start_block,
    start_shadows,
)
from drone_rl.sim.rendering.raytrace.spans_kernel import fill, mix_gray
from drone_rl.sim.rendering.raytrace.structs_kernel import struct
from drone_rl.sim.rendering.raytrace.triangles_kernel import (
    Triangles,
    triangle_normal,
)

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
    faces: wp.array2d[Surface]
    """Two surfaces, while they are shaded."""
    boxes: wp.array2d[float]
    """See `Shadows`, as the rest."""
    points: wp.array2d[float]
    blocked: wp.array2d[int]
    is_known: wp.array2d[int]
    colors: wp.array2d[wp.vec3]
    """See `Block`, as the rest."""
    is_shown: wp.array2d[int]
    pixels: wp.array2d[wp.vec3ub]


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
        shadows = Shadows()
        shadows.geoms = scratch.geoms[buffer]
        shadows.boxes = scratch.boxes[buffer]
        shadows.points = scratch.points[buffer]
        shadows.blocked = scratch.blocked[buffer]
        shadows.is_known = scratch.is_known[buffer]
        shadows.meshes = scratch.order[buffer]
        faces = scratch.faces[buffer]
        block = Block()
        block.colors = scratch.colors[buffer]
        block.is_shown = scratch.is_shown[buffer]
        block.pixels = scratch.pixels[buffer]
        if (view.what & structs.RGB) != 0:
            block.pixels = images.rgb[row]
        write(canvas, view, world, look, shot, to_world, shadows, faces, block, images, row)
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
    shadows: Shadows,
    faces: wp.array[Surface],
    block: Block,
    images: structs.Images,
    row: int,
) -> None:
    """Write all modalities of the image `row` from a canvas."""
    what = view.what
    if (what & (structs.RGB | structs.GRAY)) != 0:
        write_colors(canvas, what, world, look, shot, to_world, shadows, faces, block, images, row)
    if (what & structs.DEPTH) != 0:
        canvases.copy_depths(canvas, images.depth[row], False)
    if (what & structs.DISTANCE) != 0:
        canvases.copy_depths(canvas, images.distance[row], True)
    if (what & structs.SEGMENTATION) != 0:
        canvases.copy_owners(canvas, world.geoms.number, images.segmentation[row])
    if (what & structs.NORMALS) != 0:
        write_normals(canvas, world.triangles, shadows.geoms, images.normals[row])


@wp.func
def pixel_ray(canvas: canvases.Canvas, x: int, y: int) -> wp.vec3:
    """Return the direction through a pixel, with length 1 along the camera's axis."""
    return wp.vec3(
        (float(x) - canvas.x0) / canvas.x_scale, (canvas.y0 - float(y)) / canvas.y_scale, -1.0
    )


@wp.func
def write_normals(
    canvas: canvases.Canvas,
    triangles: Triangles,
    geoms: wp.array[structs.GeomView],
    normals: wp.array[wp.vec3],
) -> None:
    """Write the unit normal of what each pixel shows, world frame."""
    tile = int(0)
    while tile < canvas.across * canvas.down:
        left, top = 8 * (tile % canvas.across), 8 * (tile // canvas.across)
        k = int(0)
        while k < 64:
            x, y = left + (k & 7), top + (k >> 3)
            if x < canvas.width and y < canvas.height:
                at = 64 * tile + k
                owner = canvas.owner[at]
                normal = wp.vec3()
                if owner != structs.NO_GEOM:
                    ray, depth = pixel_ray(canvas, x, y), canvas.depth[at]
                    part = canvas.part[at]
                    normal = geoms[owner].axes @ _normal(triangles, geoms[owner], part, ray, depth)
                normals[y * canvas.width + x] = normal
            k += 1
        tile += 1


@wp.func
def _normal(
    triangles: Triangles, seen: structs.GeomView, part: int, ray: wp.vec3, depth: float
) -> wp.vec3:
    """Return the unit normal of what a ray meets, on the side that is seen, geom's frame."""
    if seen.kind == MESH:
        return triangle_normal(triangles, part)
    if seen.kind == PLANE:
        return wp.vec3(0.0, 0.0, wp.sign(seen.eye[2]))
    return surface_normal(seen.kind, seen.size, part, seen.eye, seen.into @ ray, depth)


@wp.func
def write_colors(
    canvas: canvases.Canvas,
    what: int,
    world: World,
    look: Look,
    shot: Shot,
    to_world: wp.mat33,
    shadows: Shadows,
    faces: wp.array[Surface],
    block: Block,
    images: structs.Images,
    row: int,
) -> None:
    """Write colors. What consecutive pixels of a face share is computed once, in `faces[0]`."""
    geoms, texels = shadows.geoms, look.textures.texels
    last_owner = int(structs.NO_GEOM)
    last_part = int(0)
    tile = int(0)
    while tile < canvas.across * canvas.down:
        left, top = 8 * (tile % canvas.across), 8 * (tile // canvas.across)
        _start_tile(canvas, world.triangles, shadows, shot, to_world, tile)
        fill(block.is_shown, 0, 64, 0)
        k = int(0)
        while k < 64:
            x, y = left + (k & 7), top + (k >> 3)
            if block.is_shown[k] == 0 and x < canvas.width and y < canvas.height:
                owner, part = int(canvas.owner[64 * tile + k]), int(canvas.part[64 * tile + k])
                ray = pixel_ray(canvas, x, y)
                if owner == structs.NO_GEOM:
                    block.colors[k] = sky(texels, to_world @ ray, shot)
                else:
                    if owner != last_owner or part != last_part:
                        is_same = owner == last_owner
                        turn_to(world.triangles, look, shot, geoms[owner], part, is_same, faces)
                    last_owner = owner
                    last_part = part
                    depth = canvas.depth[64 * tile + k]
                    point = point_of(geoms, owner, part, ray, depth, faces)
                    is_simple = faces[0].is_simple and shot.num_casting == 0
                    if is_simple and reach_patch(world.triangles, faces, 0, point, shot, True):
                        shade_patch(canvas, tile, k, geoms[owner], faces, shot, texels, block)
                    else:
                        seen = geoms[owner]
                        direction = to_world @ ray
                        block.colors[k] = shade_pixel(
                            look, world, shot, seen, part, point, direction, shadows, k, faces
                        )
            k += 1
        canvases.copy_colors(canvas, tile, block.colors, block.pixels)
        tile += 1
    if (what & structs.GRAY) != 0:
        count = canvas.width * canvas.height
        mix_gray(images.gray[row], 0, count, block.pixels, RED, GREEN, BLUE)


@wp.func
def shade_pixel(
    look: Look,
    world: World,
    shot: Shot,
    seen: structs.GeomView,
    part: int,
    point: Point,
    ray: wp.vec3,
    shadows: Shadows,
    k: int,
    faces: wp.array[Surface],
) -> wp.vec3:
    """Return the color of a pixel, `k` of its tile, which shows `faces[0]`."""
    if faces[0].opacity < OPAQUE:
        hit = hit_of(world, shot, seen, part, point, ray)
        return shade(look, world, hit, wp.normalize(ray), shot, shadows, faces)
    shown = find_light(world.triangles, faces, 0, point, shot, True)
    if shot.num_casting > 0:
        shown = add_casting(world, shadows, 0, k, shot, shown)
    shown = wp.cw_mul(shown, sample_surface(look.textures.texels, faces, 0, point))
    return finish(shown, point.depth * wp.length(ray), shot)


@wp.func
def _start_tile(
    canvas: canvases.Canvas,
    triangles: Triangles,
    shadows: Shadows,
    shot: Shot,
    to_world: wp.mat33,
    tile: int,
) -> None:
    """Set the points that the pixels of a tile show, if there are shadows."""
    if shot.num_casting == 0:
        return
    if tile == 0:
        start_shadows(shadows, shadows.geoms.shape[0])
    start_block(shadows, 0)
    left, top = 8 * (tile % canvas.across), 8 * (tile // canvas.across)
    k = int(0)
    while k < PIXELS:
        x, y = left + (k & 7), top + (k >> 3)
        at = 64 * tile + k
        owner = canvas.owner[at]
        place, normal, far = wp.vec3(), wp.vec3(), float(0.0)
        if x < canvas.width and y < canvas.height and owner != structs.NO_GEOM:
            seen = shadows.geoms[owner]
            ray, depth = pixel_ray(canvas, x, y), canvas.depth[at]
            local = wp.vec3(0.0, 0.0, 1.0)  # planes have light on their upper sides
            if seen.kind != PLANE:
                local = _normal(triangles, seen, canvas.part[at], ray, depth)
            normal = seen.axes @ local
            place = depth * (to_world @ ray)
            far = depth * wp.length(ray)
        set_point(shadows, 0, k, place, normal, far)
        k += 1


@wp.func
def turn_to(
    triangles: Triangles,
    look: Look,
    shot: Shot,
    seen: structs.GeomView,
    part: int,
    is_same: bool,
    faces: wp.array[Surface],
) -> None:
    """Make `faces[0]` a face of a geom; `is_same`: it is another one of the same geom already."""
    if not is_same or seen.kind != MESH:
        normal = wp.vec3()
        if seen.kind != MESH and part != ROUND:
            normal[part // 2] = 2.0 * float(part % 2) - 1.0
        faces[0] = make_surface(
            look.surfaces,
            look.textures,
            shot,
            seen.number,
            seen.kind,
            part,
            seen.size,
            seen.axes,
            seen.eye,
            normal,
        )
    start_face(triangles, faces, 0, part)


@wp.func
def point_of(
    geoms: wp.array[structs.GeomView],
    owner: int,
    part: int,
    ray: wp.vec3,
    depth: float,
    faces: wp.array[Surface],
) -> Point:
    """Return what a pixel shows of `faces[0]`."""
    point = Point()
    point.depth = depth
    point.ray = geoms[owner].into @ ray
    point.local = geoms[owner].eye + depth * point.ray
    point.normal = faces[0].face.normal
    if faces[0].face.is_round:
        kind, size, eye = geoms[owner].kind, geoms[owner].size, geoms[owner].eye
        point.normal = surface_normal(kind, size, part, eye, point.ray, depth)
    return point


@wp.func
def hit_of(
    world: World, shot: Shot, seen: structs.GeomView, part: int, point: Point, ray: wp.vec3
) -> Hit:
    """Return what a pixel shows as the hit of a ray, world frame."""
    hit = Hit()
    hit.env = shot.env
    hit.geom = seen.number
    hit.distance = point.depth * wp.length(ray)
    direction = wp.normalize(ray)
    hit.point = shot.position + hit.distance * direction
    return complete_hit(
        hit, world, seen.kind, seen.size, seen.axes, part, seen.eye, wp.normalize(point.ray)
    )
