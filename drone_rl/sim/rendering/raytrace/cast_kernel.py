"""Single rays through a scene of any geoms: what they hit."""

import mujoco
import warp as wp

from drone_rl.sim.rendering.raytrace.intersection_kernel import (
    FAR_AWAY,
    PLANE,
    SAME,
    UPPER,
    intersect_solid,
    surface_normal,
)
from drone_rl.sim.rendering.raytrace.projection_kernel import frame_attitude, product, rotation
from drone_rl.sim.rendering.raytrace.structs_kernel import (
    NO_GEOM,
    Geoms,
    PoseArrays,
    struct,
)
from drone_rl.sim.rendering.raytrace.triangles_kernel import (
    Triangles,
    smooth_normal,
    trace_mesh,
    triangle_normal,
    triangle_weights,
)

wp.set_module_options({"enable_backward": False, "fuse_fp": False})

MESH = wp.constant(int(mujoco.mjtGeom.mjGEOM_MESH))
"""Kind of every geom that is made of triangles."""


@struct
class World:
    """A scene of any geoms, and where its frames are in each environment."""

    geoms: Geoms
    """Those that are rendered. `number` is their index in the model."""
    mesh: wp.array[int]
    """Of each rendered geom, in `triangles`; -1 for none."""
    triangles: Triangles
    poses: PoseArrays


@struct
class Hit:
    """What a ray hits first. Metres, world frame unless stated."""

    env: int
    geom: int
    """Index in the model; -1 for nothing, and then all but `env` is zero."""
    kind: int
    part: int
    """Its face, see `intersection_kernel.ROUND`, or triangle."""
    distance: float
    """Along the ray."""
    point: wp.vec3
    face_normal: wp.vec3
    """Unit normal of the surface, on the side that is seen."""
    normal: wp.vec3
    """Unit normal for shading, which meshes interpolate between their corners."""
    local: wp.vec3
    """The point in the geom's frame."""
    local_normal: wp.vec3
    """`face_normal` in the geom's frame."""
    axes: wp.mat33
    """Rotates directions from the geom's frame to the world's."""
    size: wp.vec3
    """Of the geom, as MuJoCo's; zero for meshes and height fields."""


@struct
class GeomRay:
    """A ray in a geom's frame."""

    kind: int
    size: wp.vec3
    axes: wp.mat33
    """Rotates directions from the geom's frame to the world's."""
    origin: wp.vec3
    ray: wp.vec3


@wp.func
def to_geom(world: World, env: int, geom: int, origin: wp.vec3, ray: wp.vec3) -> GeomRay:
    """Return a ray in the frame of a rendered geom."""
    frame = world.geoms.frame[geom]
    turned = frame_attitude(frame, world.poses.attitudes[env])
    made = GeomRay()
    made.kind = world.geoms.kind[geom]
    made.size = world.geoms.size[geom]
    if world.poses.scales:
        made.size *= world.poses.scales[env, frame]
    place = world.poses.positions[env, frame] + rotation(turned) @ world.geoms.position[geom]
    made.axes = rotation(product(turned, world.geoms.attitude[geom]))
    back = wp.transpose(made.axes)
    made.origin = back @ (origin - place)
    made.ray = back @ ray
    return made


@wp.func
def intersect_both_sides(size: wp.vec3, point: wp.vec3, ray: wp.vec3) -> float:
    """Return the distance to a rectangle of the plane z = 0; size 0 is infinite, -1 a miss."""
    if point[2] * ray[2] >= 0.0:
        return -1.0
    along = -point[2] / ray[2]
    if size[0] > 0.0 and wp.abs(point[0] + along * ray[0]) > size[0]:
        return -1.0
    if size[1] > 0.0 and wp.abs(point[1] + along * ray[1]) > size[1]:
        return -1.0
    return along


@wp.func
def cast(world: World, env: int, origin: wp.vec3, direction: wp.vec3, far: float) -> Hit:
    """Return what a ray hits first in an environment.

    As in OpenGL, solids are not seen from inside nor triangles from behind; planes are seen from
    both sides. Of two geoms at one distance the later is hit. `direction` has length 1, `far` is
    the farthest distance, metres.
    """
    nearest = float(FAR_AWAY)
    owner = int(NO_GEOM)
    part = int(0)
    geom = int(0)
    while geom < world.geoms.kind.shape[0]:
        local = to_geom(world, env, geom, origin, direction)
        along = float(-1.0)
        face = int(UPPER)
        if local.kind == PLANE:
            along = intersect_both_sides(local.size, local.origin, local.ray)
        elif local.kind == MESH:
            found = trace_mesh(
                world.triangles, world.mesh[geom], local.origin, local.ray, far, False, False
            )
            along = float(found[0])
            face = int(found[1])
        else:
            along, face = intersect_solid(local.kind, local.size, local.origin, local.ray)
        is_near = along <= far and along - nearest <= SAME * wp.max(nearest, 1.0)
        if along >= 0.0 and is_near:
            nearest = along
            owner = geom
            part = face
        geom += 1
    if owner == NO_GEOM:
        missed = Hit()
        missed.env = env
        missed.geom = NO_GEOM
        return missed
    return make_hit(world, env, owner, part, origin, direction, nearest)


@wp.func
def make_hit(
    world: World, env: int, geom: int, part: int, origin: wp.vec3, direction: wp.vec3, along: float
) -> Hit:
    """Return what is hit: `part` is the face of a rendered geom, or the triangle."""
    local = to_geom(world, env, geom, origin, direction)
    hit = Hit()
    hit.env = env
    hit.geom = world.geoms.number[geom]
    hit.distance = along
    hit.point = origin + along * direction
    return complete_hit(
        hit, world, local.kind, local.size, local.axes, part, local.origin, local.ray
    )


@wp.func
def complete_hit(
    hit: Hit,
    world: World,
    kind: int,
    size: wp.vec3,
    axes: wp.mat33,
    part: int,
    origin: wp.vec3,
    ray: wp.vec3,
) -> Hit:
    """Return a hit with all that depends on the geom.

    `axes` rotates directions from the geom's frame, in which `origin` and `ray` are, to the world.
    """
    hit.kind = kind
    hit.part = part
    hit.axes = axes
    hit.local = origin + hit.distance * ray
    if kind == MESH:
        triangles = world.triangles
        hit.local_normal = triangle_normal(triangles, part)
        hit.face_normal = axes @ hit.local_normal
        weights = triangle_weights(triangles, part, origin, ray)
        hit.normal = axes @ smooth_normal(triangles, part, weights)
    else:
        hit.size = size
        hit.local_normal = surface_normal(kind, size, part, origin, ray, hit.distance)
        if kind == PLANE and origin[2] < 0.0:
            hit.local_normal = -hit.local_normal
        hit.face_normal = axes @ hit.local_normal
        hit.normal = hit.face_normal
    return hit
