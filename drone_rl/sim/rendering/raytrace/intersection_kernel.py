"""Ray casting: intersections of rays with solids and planes, each in its own frame.

Solids are convex and closed; rays that start inside one miss it. Sizes are MuJoCo's: half extents
of boxes and ellipsoids, the radius of balls, radius and half length of capsules and cylinders.
"""

import mujoco
import warp as wp

PLANE = wp.constant(int(mujoco.mjtGeom.mjGEOM_PLANE))
SPHERE = wp.constant(int(mujoco.mjtGeom.mjGEOM_SPHERE))
CAPSULE = wp.constant(int(mujoco.mjtGeom.mjGEOM_CAPSULE))
ELLIPSOID = wp.constant(int(mujoco.mjtGeom.mjGEOM_ELLIPSOID))
CYLINDER = wp.constant(int(mujoco.mjtGeom.mjGEOM_CYLINDER))
BOX = wp.constant(int(mujoco.mjtGeom.mjGEOM_BOX))

ROUND = wp.constant(6)
"""Round part of a surface. Flat faces are 0 to 5, with normals along -x, +x, -y, +y, -z, +z."""
UPPER = wp.constant(5)
"""Face of a plane: its upper side is visible."""
FAR_AWAY = wp.constant(1e10)
"""Metres: farther than anything; the distance along a ray before anything is hit."""
SAME = wp.constant(1e-6)
"""Relative distance within which the later of two geoms is in front, as in OpenGL."""

_PARALLEL = wp.constant(1e-15)
"""Component of a direction below which a ray counts as parallel to a plane."""


@wp.func
def _enter_box(size: wp.vec3, point: wp.vec3, ray: wp.vec3) -> tuple[float, int]:
    """Test the faces, at most three, that the point is in front of."""
    nearest = -1.0
    face = int(0)
    for i in range(3):
        if wp.abs(ray[i]) > _PARALLEL:
            side = -wp.sign(ray[i])
            if side * point[i] >= size[i]:
                along = (side * size[i] - point[i]) / ray[i]
                j = (i + 1) % 3
                k = (i + 2) % 3
                inside = (
                    wp.abs(point[j] + along * ray[j]) <= size[j]
                    and wp.abs(point[k] + along * ray[k]) <= size[k]
                )
                if inside and (nearest < 0.0 or along < nearest):
                    nearest = along
                    face = _flat(i, side)
    return nearest, face


@wp.func
def _flat(axis: int, side: float) -> int:
    if side > 0.0:
        return 2 * axis + 1
    return 2 * axis


@wp.func
def _enter_ball(radius: float, point: wp.vec3, ray: wp.vec3) -> float:
    """Distance to a ball around the origin; negative for a miss or a start inside."""
    a = wp.dot(ray, ray)
    b = wp.dot(ray, point)
    discriminant = b * b - a * (wp.dot(point, point) - radius * radius)
    if discriminant <= 0.0:
        return -1.0
    return (-b - wp.sqrt(discriminant)) / a


@wp.func
def _enter_tube(radius: float, half: float, point: wp.vec3, ray: wp.vec3) -> tuple[float, int]:
    """A cylinder: the intersection of an infinite tube and two planes."""
    a = ray[0] * ray[0] + ray[1] * ray[1]
    b = ray[0] * point[0] + ray[1] * point[1]
    c = point[0] * point[0] + point[1] * point[1] - radius * radius
    tube_in = -FAR_AWAY
    tube_out = FAR_AWAY
    if a > _PARALLEL:
        discriminant = b * b - a * c
        if discriminant <= 0.0:
            return -1.0, ROUND
        tube_in = (-b - wp.sqrt(discriminant)) / a
        tube_out = (-b + wp.sqrt(discriminant)) / a
    elif c > 0.0:
        return -1.0, ROUND
    ends_in = -FAR_AWAY
    ends_out = FAR_AWAY
    side = -wp.sign(ray[2])
    if wp.abs(ray[2]) > _PARALLEL:
        ends_in = (side * half - point[2]) / ray[2]
        ends_out = (-side * half - point[2]) / ray[2]
    elif wp.abs(point[2]) > half:
        return -1.0, ROUND
    along = wp.max(tube_in, ends_in)
    if along > wp.min(tube_out, ends_out):
        return -1.0, ROUND
    if tube_in > ends_in:
        return along, ROUND
    return along, _flat(2, side)


@wp.func
def _enter_capsule(radius: float, half: float, point: wp.vec3, ray: wp.vec3) -> float:
    """The nearest of its round side and its two balls; no ray from inside enters."""
    from_axis = point - wp.vec3(0.0, 0.0, wp.clamp(point[2], -half, half))
    if wp.length_sq(from_axis) < radius * radius:
        return -1.0
    nearest = float(FAR_AWAY)
    a = ray[0] * ray[0] + ray[1] * ray[1]
    b = ray[0] * point[0] + ray[1] * point[1]
    c = point[0] * point[0] + point[1] * point[1] - radius * radius
    if a > _PARALLEL and b * b - a * c > 0.0:
        along = (-b - wp.sqrt(b * b - a * c)) / a
        if along >= 0.0 and wp.abs(point[2] + along * ray[2]) <= half:
            nearest = along
    for i in range(2):
        end = wp.vec3(0.0, 0.0, (2.0 * float(i) - 1.0) * half)
        along = _enter_ball(radius, point - end, ray)
        if along >= 0.0 and along < nearest:
            nearest = along
    if nearest == FAR_AWAY:
        return -1.0
    return nearest


@wp.func
def intersect_solid(kind: int, size: wp.vec3, point: wp.vec3, ray: wp.vec3) -> tuple[float, int]:
    """Return where a ray enters a solid: distance, negative for a miss, and face."""
    if kind == BOX:
        along, face = _enter_box(size, point, ray)
        return along, face
    if kind == CYLINDER:
        along, face = _enter_tube(size[0], size[1], point, ray)
        return along, face
    if kind == CAPSULE:
        return _enter_capsule(size[0], size[1], point, ray), ROUND
    radii = _radii(kind, size)
    return _enter_ball(1.0, wp.cw_div(point, radii), wp.cw_div(ray, radii)), ROUND


@wp.func
def surface_normal(
    kind: int, size: wp.vec3, face: int, point: wp.vec3, ray: wp.vec3, along: float
) -> wp.vec3:
    """Return the normal where a ray has entered a geom, in the geom's frame."""
    if face != ROUND:
        normal = wp.vec3()
        normal[face // 2] = 2.0 * float(face % 2) - 1.0
        return normal
    hit = point + along * ray
    if kind == CYLINDER:
        return wp.normalize(wp.vec3(hit[0], hit[1], 0.0))
    if kind == CAPSULE:
        return wp.normalize(hit - wp.vec3(0.0, 0.0, wp.clamp(hit[2], -size[1], size[1])))
    radii = _radii(kind, size)
    round_hit = wp.cw_div(point, radii) + along * wp.cw_div(ray, radii)
    return wp.normalize(wp.cw_div(round_hit, radii))


@wp.func
def _radii(kind: int, size: wp.vec3) -> wp.vec3:
    if kind == SPHERE:
        return wp.vec3(size[0], size[0], size[0])
    return size


@wp.func
def intersect_plane(size: wp.vec3, point: wp.vec3, ray: wp.vec3) -> float:
    """Return the distance to a rectangle of the plane z = 0 from above; size 0 is infinite.

    The distance is negative for a miss.
    """
    if ray[2] >= -_PARALLEL:
        return -1.0
    along = -point[2] / ray[2]
    if size[0] > 0.0 and wp.abs(point[0] + along * ray[0]) > size[0]:
        return -1.0
    if size[1] > 0.0 and wp.abs(point[1] + along * ray[1]) > size[1]:
        return -1.0
    return along


@wp.func
def is_nearest(along: float, so_far: float, cosine: float, far: float) -> bool:
    """Return whether a hit `along` the ray, negative for a miss, is in front of the one `so_far`.

    `cosine` is that of the angle to the camera's axis, `far` the metres along it that are rendered.
    """
    return along >= 0.0 and along - so_far <= SAME * wp.max(so_far, 1.0) and along * cosine <= far
