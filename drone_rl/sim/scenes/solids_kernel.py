"""Distances to the solids of scenes, and paths of balls that solids stop: the one contact query.

All functions are of one environment. Lengths in metres, world frame, in float64; triangles have
float32 vertices in the frame of their mesh.
"""

import warp as wp

wp.set_module_options({"enable_backward": False, "fuse_fp": False})

PLANE = wp.constant(0)
BALL = wp.constant(1)
CAPSULE = wp.constant(2)
ELLIPSOID = wp.constant(3)
CYLINDER = wp.constant(4)
BOX = wp.constant(5)
SURFACE = wp.constant(6)
"""Triangles without an inside."""
BODY = wp.constant(7)
"""Triangles around an inside."""
NO_SOLID = wp.constant(-1)

ABSENT = wp.constant(wp.float64(-5000.0))
"""Height of its origin below which a group is absent, metres."""
TOUCHING = wp.constant(wp.float64(1e-4))
"""Gap below which a ball touches a solid, metres."""
_MEETING = wp.constant(wp.float64(1e-9))
"""Gap at which a path ends, metres."""
_SIDE = wp.constant(wp.float64(5e-10))
"""Gap that a path leaves, so that its end is on the side of a wall that it came from, metres."""
_ALONG = wp.constant(wp.float64(1e-5))
"""Slope below which a path is parallel to a surface: vertices are rounded."""
_NEWTON = wp.constant(60)
"""Most steps of a search; each at least halves what is missing."""
_ZERO = wp.constant(wp.float64(0.0))
_ONE = wp.constant(wp.float64(1.0))


@wp.struct
class Solid:
    """One geom, in the frame of its group."""

    kind: int
    mesh: wp.uint64
    center: wp.vec3d
    turn: wp.mat33d
    """From its own frame to the group's."""
    size: wp.vec3d
    """As in MuJoCo: radius, half extents, semi-axes; half length of capsules and cylinders."""


@wp.struct
class Node:
    """A box around solids of a group. Nodes follow in depth-first order."""

    low: wp.vec3d
    high: wp.vec3d
    skip: int
    """Number of the first node that is not below this one."""
    solid: int
    """Number of its only solid, or `NO_SOLID` if nodes below it have them."""


@wp.struct
class SolidArrays:
    """Solids in G groups, each of which has a place in N environments."""

    solids: wp.array[Solid]
    nodes: wp.array[Node]
    roots: wp.array[int]
    """First node of each group, and the number of all nodes. Shape: (G + 1,)."""
    places: wp.array2d[wp.vec3d]
    """Origins of the groups, below `ABSENT` where one is absent. Shape: (N, G)."""


@wp.struct
class Found:
    """What is nearest to a point."""

    distance: wp.float64
    """To its surface; negative inside."""
    normal: wp.vec3d
    """Unit vector along which the distance grows."""
    solid: int
    """Its number, or `NO_SOLID`."""


@wp.struct
class Stop:
    """The end of a ball's path."""

    fraction: wp.float64
    """Of the path; infinite if nothing stops the ball."""
    solid: int
    """Number of what stops it, or `NO_SOLID`."""


@wp.func
def _unit(vector: wp.vec3d) -> wp.vec3d:
    """Return a vector of length 1, or 0 if it is too short to have a direction."""
    length = wp.length(vector)
    found = wp.vec3d()
    if length > wp.float64(1e-12):
        found = vector / length
    return found


@wp.func
def _around(away: wp.vec3d, radius: wp.float64) -> Found:
    """Return the distance from a ball whose centre is at `away` from the nearest axis point."""
    found = Found()
    found.distance = wp.length(away) - radius
    found.normal = _unit(away)
    return found


@wp.func
def _of_box(point: wp.vec3d, half: wp.vec3d) -> Found:
    beyond = wp.vec3d(wp.abs(point[0]), wp.abs(point[1]), wp.abs(point[2])) - half
    found = Found()
    if wp.max(beyond) > _ZERO:
        outside = wp.vec3d(
            wp.sign(point[0]) * wp.max(beyond[0], _ZERO),
            wp.sign(point[1]) * wp.max(beyond[1], _ZERO),
            wp.sign(point[2]) * wp.max(beyond[2], _ZERO),
        )
        found.distance = wp.length(outside)
        found.normal = outside / found.distance
        return found
    axis = wp.argmax(beyond)
    found.distance = wp.max(beyond)
    for i in range(3):
        if i == int(axis):
            found.normal[i] = wp.sign(point[i])
    return found


@wp.func
def _of_cylinder(point: wp.vec3d, radius: wp.float64, half: wp.float64) -> Found:
    flat = wp.sqrt(point[0] * point[0] + point[1] * point[1])
    out = wp.vec3d(_ONE, _ZERO, _ZERO)
    if flat > wp.float64(1e-12):
        out = wp.vec3d(point[0] / flat, point[1] / flat, _ZERO)
    up = wp.vec3d(_ZERO, _ZERO, wp.sign(point[2]))
    aside = flat - radius
    above = wp.abs(point[2]) - half
    found = Found()
    if aside > _ZERO and above > _ZERO:
        found.distance = wp.sqrt(aside * aside + above * above)
        found.normal = (aside * out + above * up) / found.distance
    elif aside > above:
        found.distance = aside
        found.normal = out
    else:
        found.distance = above
        found.normal = up
    return found


@wp.func
def _of_ellipsoid(point: wp.vec3d, axes: wp.vec3d) -> Found:
    """Search the nearest point, a * a * y / (t + a * a) along each axis, by Newton's method.

    The sum of the squares of y * a / (t + a * a) falls with t and is convex: from a t at which it
    is too large, the search does not pass the t at which it is 1. It counts from the least t, minus
    the square of the shortest axis, so that it is exact there.
    """
    y = wp.vec3d()
    shortest = wp.min(axes)
    base = wp.vec3d()
    t = wp.float64(0.0)
    inside = wp.float64(-1.0)
    for i in range(3):
        y[i] = axes[i] * wp.max(wp.abs(point[i]), wp.float64(1e-9) * axes[i])
        base[i] = (axes[i] - shortest) * (axes[i] + shortest)
        t = wp.max(t, y[i] - base[i])
        inside += (point[i] / axes[i]) * (point[i] / axes[i])
    for _ in range(_NEWTON):
        excess = wp.float64(-1.0)
        slope = wp.float64(0.0)
        for i in range(3):
            ratio = y[i] / (t + base[i])
            excess += ratio * ratio
            slope += wp.float64(2.0) * ratio * ratio / (t + base[i])
        t += wp.max(excess, _ZERO) / slope
    found = Found()
    near = wp.vec3d()
    for i in range(3):
        near[i] = axes[i] * y[i] / (t + base[i])
        if point[i] < _ZERO:
            near[i] = -near[i]
        found.normal[i] = near[i] / (axes[i] * axes[i])
    found.normal = _unit(found.normal)
    found.distance = wp.length(point - near)
    if inside < _ZERO:
        found.distance = -found.distance
    return found


@wp.func
def _convex(solid: Solid, point: wp.vec3d) -> Found:
    """Return the distance to a primitive; all in its own frame."""
    size = solid.size
    found = Found()
    if solid.kind == PLANE:
        found.distance = point[2]
        found.normal = wp.vec3d(_ZERO, _ZERO, _ONE)
    elif solid.kind == BALL:
        found = _around(point, size[0])
    elif solid.kind == CAPSULE:
        along = wp.clamp(point[2], -size[1], size[1])
        found = _around(point - wp.vec3d(_ZERO, _ZERO, along), size[0])
    elif solid.kind == ELLIPSOID:
        found = _of_ellipsoid(point, size)
    elif solid.kind == CYLINDER:
        found = _of_cylinder(point, size[0], size[1])
    else:
        found = _of_box(point, size)
    return found


@wp.func
def _corner(mesh: wp.uint64, face: int, i: int) -> wp.vec3d:
    return wp.vec3d(wp.mesh_get_point(mesh, 3 * face + i))


@wp.func
def _of_triangle(point: wp.vec3d, a: wp.vec3d, b: wp.vec3d, c: wp.vec3d) -> Found:
    """Return the distance to a triangle, by the region that the point is in (Ericson, 2005)."""
    ab = b - a
    ac = c - a
    d1 = wp.dot(ab, point - a)
    d2 = wp.dot(ac, point - a)
    d3 = wp.dot(ab, point - b)
    d4 = wp.dot(ac, point - b)
    d5 = wp.dot(ab, point - c)
    d6 = wp.dot(ac, point - c)
    va = d3 * d6 - d5 * d4
    vb = d5 * d2 - d1 * d6
    vc = d1 * d4 - d3 * d2
    near = a
    if d1 <= _ZERO and d2 <= _ZERO:
        near = a
    elif d3 >= _ZERO and d4 <= d3:
        near = b
    elif d6 >= _ZERO and d5 <= d6:
        near = c
    elif vc <= _ZERO and d1 >= _ZERO and d3 <= _ZERO:
        near = a + d1 / (d1 - d3) * ab
    elif vb <= _ZERO and d2 >= _ZERO and d6 <= _ZERO:
        near = a + d2 / (d2 - d6) * ac
    elif va <= _ZERO and d4 - d3 >= _ZERO and d5 - d6 >= _ZERO:
        near = b + (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (c - b)
    else:
        whole = va + vb + vc
        near = a + vb / whole * ab + vc / whole * ac
    found = _around(point - near, _ZERO)
    if wp.length_sq(found.normal) == _ZERO:  # on the triangle
        found.normal = _unit(wp.cross(ab, ac))
    return found


@wp.func
def _crosses(point: wp.vec3d, a: wp.vec3d, b: wp.vec3d) -> int:
    """Return 1 if an edge, seen from above, passes the point's right side upwards, -1 downwards.

    Triangles that share the edge find the same side, since its ends are ordered first.
    """
    above_a = a[1] > point[1]
    above_b = b[1] > point[1]
    if above_a == above_b:
        return 0
    low = a
    high = b
    up = int(1)
    if above_a:
        low = b
        high = a
        up = int(-1)
    aside = (high[0] - low[0]) * (point[1] - low[1]) - (high[1] - low[1]) * (point[0] - low[0])
    if aside > _ZERO:
        return up
    return 0


@wp.func
def _is_inside(mesh: wp.uint64, point: wp.vec3d, top: wp.float64) -> bool:
    """Return whether the surface above a point faces up more often than down.

    So a shell that faces its inside, such as a room, leaves it free.
    """
    narrow = wp.vec3(1.0e-6, 1.0e-6, 0.0)
    at = wp.vec3(point)
    slack = wp.cw_mul(narrow, wp.vec3(wp.abs(at[0]), wp.abs(at[1]), 0.0)) + narrow
    high = wp.vec3(at[0], at[1], wp.max(float(top), at[2]))
    query = wp.mesh_query_aabb(mesh, at - slack, high + slack)
    face = int(0)
    winding = int(0)
    while wp.mesh_query_aabb_next(query, face):
        a = _corner(mesh, face, 0)
        b = _corner(mesh, face, 1)
        c = _corner(mesh, face, 2)
        turns = _crosses(point, a, b) + _crosses(point, b, c) + _crosses(point, c, a)
        if turns != 0:
            normal = wp.cross(b - a, c - a)
            if wp.dot(normal, a - point) * normal[2] > _ZERO:
                winding += turns
    return winding > 0


@wp.func
def _of_mesh(solid: Solid, point: wp.vec3d, within: wp.float64) -> Found:
    """Return the distance to the nearest triangle, if it is less than `within`, or inside."""
    found = Found()
    found.distance = wp.float64(wp.inf)
    far = wp.min(wp.max(within, _ZERO) * wp.float64(1.001) + TOUCHING, wp.float64(1e9))
    inside = False
    beyond = wp.vec3d(wp.abs(point[0]), wp.abs(point[1]), wp.abs(point[2])) - solid.size
    if solid.kind == BODY and wp.max(beyond) <= _ZERO:
        inside = _is_inside(solid.mesh, point, solid.size[2])
    if inside:
        far = wp.float64(1e9)
    query = wp.mesh_query_point_no_sign(solid.mesh, wp.vec3(point), float(far))
    if query.result:
        a = _corner(solid.mesh, query.face, 0)
        b = _corner(solid.mesh, query.face, 1)
        c = _corner(solid.mesh, query.face, 2)
        found = _of_triangle(point, a, b, c)
        if inside and found.distance > wp.float64(1e-12):
            found.distance = -found.distance
            found.normal = -found.normal
    return found


@wp.func
def _beyond(node: Node, point: wp.vec3d) -> wp.float64:
    """Return the distance of a point from a node's box."""
    away = wp.max(wp.max(node.low - point, point - node.high), wp.vec3d())
    return wp.length(away)


@wp.func
def nearest(arrays: SolidArrays, env: int, point: wp.vec3d, within: wp.float64) -> Found:
    """Return the nearest solid; `NO_SOLID`, at the distance `within`, if none is nearer."""
    found = Found()
    found.distance = within
    found.solid = NO_SOLID
    group = int(0)
    while group < arrays.places.shape[1]:
        origin = arrays.places[env, group]
        if origin[2] > ABSENT:
            there = point - origin
            number = arrays.roots[group]
            last = arrays.roots[group + 1]
            while number < last:
                node = arrays.nodes[number]
                if _beyond(node, there) > wp.max(found.distance, _ZERO):
                    number = node.skip
                    continue
                number += 1
                if node.solid != NO_SOLID:
                    solid = arrays.solids[node.solid]
                    local = wp.transpose(solid.turn) * (there - solid.center)
                    one = Found()
                    if solid.kind >= SURFACE:
                        one = _of_mesh(solid, local, found.distance)
                    else:
                        one = _convex(solid, local)
                    if one.distance < found.distance:
                        found.distance = one.distance
                        found.normal = solid.turn * one.normal
                        found.solid = node.solid
        group += 1
    return found


@wp.struct
class _Search:
    """A step of the search for the end of a path."""

    fraction: wp.float64
    is_over: bool


@wp.func
def _search(near: Found, path: wp.vec3d, radius: wp.float64, fraction: wp.float64) -> _Search:
    """Return where the tangent of a convex distance reaches the radius, before the body itself."""
    step = _Search()
    step.fraction = wp.float64(wp.inf)
    step.is_over = True
    gap = near.distance - radius
    closing = -wp.dot(near.normal, path)
    is_closing = closing > _ALONG * wp.length(path)
    if gap <= _MEETING:
        if is_closing or fraction > _ZERO:
            step.fraction = fraction
    elif is_closing:
        ahead = fraction + (gap - _SIDE) / closing
        if ahead <= _ONE:
            step.fraction = ahead
            step.is_over = False
    return step


@wp.func
def _sweep_convex(solid: Solid, start: wp.vec3d, path: wp.vec3d, radius: wp.float64) -> wp.float64:
    step = _Search()
    count = int(0)
    while count < _NEWTON and not step.is_over:
        near = _convex(solid, start + step.fraction * path)
        step = _search(near, path, radius, step.fraction)
        count += 1
    return step.fraction


@wp.func
def _sweep_mesh(
    solid: Solid, start: wp.vec3d, path: wp.vec3d, radius: wp.float64, within: wp.float64
) -> wp.float64:
    """Return the least fraction of all triangles; inside of a body nothing stops a ball.

    A ball whose centre is on the surface of a body is outside of it.
    """
    first = wp.float64(wp.inf)
    is_outside = solid.kind == SURFACE
    end = start + wp.min(within, _ONE) * path
    slack = radius + TOUCHING + wp.float64(1e-6) * (wp.length(start) + wp.length(path))
    wide = wp.vec3d(slack, slack, slack)
    low = wp.vec3(wp.min(start, end) - wide)
    high = wp.vec3(wp.max(start, end) + wide)
    query = wp.mesh_query_aabb(solid.mesh, low, high)
    face = int(0)
    while wp.mesh_query_aabb_next(query, face):
        a = _corner(solid.mesh, face, 0)
        b = _corner(solid.mesh, face, 1)
        c = _corner(solid.mesh, face, 2)
        step = _Search()
        count = int(0)
        while count < _NEWTON and not step.is_over:
            near = _of_triangle(start + step.fraction * path, a, b, c)
            if count == 0 and solid.kind == BODY and near.distance <= _MEETING:
                near.normal = _unit(wp.cross(b - a, c - a))
                is_outside = True
            step = _search(near, path, radius, step.fraction)
            count += 1
        first = wp.min(first, step.fraction)
    if first < wp.float64(wp.inf) and not is_outside:
        is_inside = _is_inside(solid.mesh, start, solid.size[2])
        if is_inside:
            first = wp.float64(wp.inf)
    return first


@wp.func
def sweep(
    arrays: SolidArrays, env: int, before: wp.vec3d, now: wp.vec3d, radius: wp.float64
) -> Stop:
    """Return where the first solid stops a ball that goes straight.

    A ball that touches or overlaps a solid may move along it and away from it. A path with a place
    that is no number meets nothing.
    """
    found = Stop()
    found.fraction = wp.float64(wp.inf)
    found.solid = NO_SOLID
    path = now - before
    wide = wp.vec3d(radius, radius, radius)
    group = int(0)
    while group < arrays.places.shape[1]:
        origin = arrays.places[env, group]
        if origin[2] > ABSENT:
            start = before - origin
            low = wp.min(start, start + path) - wide
            high = wp.max(start, start + path) + wide
            number = arrays.roots[group]
            last = arrays.roots[group + 1]
            while number < last:
                node = arrays.nodes[number]
                apart = wp.max(node.low - high, low - node.high)
                if wp.max(apart) > _ZERO:
                    number = node.skip
                    continue
                number += 1
                if node.solid != NO_SOLID:
                    solid = arrays.solids[node.solid]
                    back = wp.transpose(solid.turn)
                    there = back * (start - solid.center)
                    fraction = wp.float64(wp.inf)
                    if solid.kind >= SURFACE:
                        limit = found.fraction
                        fraction = _sweep_mesh(solid, there, back * path, radius, limit)
                    else:
                        fraction = _sweep_convex(solid, there, back * path, radius)
                    if fraction < found.fraction:
                        found.fraction = fraction
                        found.solid = node.solid
        group += 1
    return found


@wp.kernel
def nearest_all(
    arrays: SolidArrays,
    points: wp.array[wp.vec3d],
    envs: wp.array[int],
    within: wp.float64,
    first: int,
    distances: wp.array[wp.float64],
    normals: wp.array[wp.vec3d],
    solids: wp.array[int],
) -> None:
    """Write what is nearest to points, a thread each."""
    i = first + wp.tid()
    found = nearest(arrays, envs[i], points[i], within)
    distances[i] = found.distance
    normals[i] = found.normal
    solids[i] = found.solid


@wp.kernel
def sweep_all(
    arrays: SolidArrays,
    before: wp.array[wp.vec3d],
    now: wp.array[wp.vec3d],
    envs: wp.array[int],
    radius: wp.float64,
    first: int,
    fractions: wp.array[wp.float64],
    solids: wp.array[int],
) -> None:
    """Write where balls stop, a thread each."""
    i = first + wp.tid()
    found = sweep(arrays, envs[i], before[i], now[i], radius)
    fractions[i] = found.fraction
    solids[i] = found.solid
