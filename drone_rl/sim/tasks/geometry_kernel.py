"""Distances to boxes, balls and upright cylinders: the one contact query, for tasks and audits.

All functions are of one environment. Lengths in metres, world frame, in float64.
"""

import warp as wp

wp.set_module_options({"enable_backward": False, "fuse_fp": False})

BALL = wp.constant(0)
CYLINDER = wp.constant(1)
BOX = wp.constant(2)
"""Shapes; a cylinder stands upright, and a box is turned about the vertical axis alone."""
BODY = wp.constant(3)
"""Shape of a scene's body, which other queries touch; its size is that of the box around it."""
GOAL = wp.constant(0)
OBSTACLE = wp.constant(1)
DECORATION = wp.constant(2)
"""Roles: only obstacles are solid, and decorations are never touched."""
NOTHING = wp.constant(-1)
"""Number of no object."""
_SEARCHES = wp.constant(48)
"""Steps of searches along a path, which shrink it by a third or a half: to below 1e-8 of it."""


@wp.struct
class Objects:
    """P objects of each of N environments."""

    shapes: wp.array[int]
    roles: wp.array[int]
    sizes: wp.array[wp.vec3d]
    """Half extents; of a ball and a cylinder the first is the radius."""
    turns: wp.array[wp.vec2d]
    """Cosine and sine of the heading."""
    places: wp.array2d[wp.vec3d]
    """Centres. Shape: (N, P), as of what follows."""
    present: wp.array2d[wp.bool]
    touched: wp.array2d[wp.bool]
    """Whether the drone has touched it in this episode."""
    moved: wp.array2d[wp.vec3d]
    """By how much each has moved in this step; no array if objects stay."""


@wp.struct
class Nearest:
    """What is nearest to a point."""

    distance: wp.float64
    """To its surface; negative inside."""
    thing: int
    """Number of the object, or `NOTHING`."""


@wp.func
def distance_to(shape: int, size: wp.vec3d, away: wp.vec3d) -> wp.float64:
    """Return the distance of a point to a surface, negative inside.

    `away` leads from the centre, as the object is turned.
    """
    zero = wp.float64(0.0)
    if shape == BALL:
        return wp.length(away) - size[0]
    beyond = wp.vec3d(wp.abs(away[0]), wp.abs(away[1]), wp.abs(away[2])) - size
    if shape == CYLINDER:
        flat = wp.sqrt(away[0] * away[0] + away[1] * away[1])
        beyond = wp.vec3d(flat - size[0], -size[0], wp.abs(away[2]) - size[2])
    outside = wp.vec3d(wp.max(beyond[0], zero), wp.max(beyond[1], zero), wp.max(beyond[2], zero))
    return wp.length(outside) + wp.min(wp.max(beyond), zero)


@wp.func
def turned(objects: Objects, thing: int, vector: wp.vec3d) -> wp.vec3d:
    """Return a vector of the world's frame as an object is turned."""
    cos, sin = objects.turns[thing][0], objects.turns[thing][1]
    return wp.vec3d(cos * vector[0] + sin * vector[1], cos * vector[1] - sin * vector[0], vector[2])


@wp.func
def nearest(objects: Objects, env: int, point: wp.vec3d, role: int) -> Nearest:
    """Return the nearest present object of a role; at an infinite distance if there is none.

    Obstacles that are bodies of a scene are not among them.
    """
    found = Nearest(wp.float64(wp.inf), int(NOTHING))
    for i in range(objects.shapes.shape[0]):
        is_known = role == GOAL or objects.shapes[i] != BODY
        if is_known and objects.roles[i] == role and objects.present[env, i]:
            away = turned(objects, i, point - objects.places[env, i])
            distance = distance_to(objects.shapes[i], objects.sizes[i], away)
            if distance < found.distance:
                found.distance = distance
                found.thing = i
    return found


@wp.func
def moved_by(objects: Objects, env: int, thing: int) -> wp.vec3d:
    """Return by how much an object has moved in this step."""
    moved = wp.vec3d()
    if objects.moved.shape[0] > 0:
        moved = objects.moved[env, thing]
    return moved


@wp.func
def sweep(
    objects: Objects, env: int, thing: int, before: wp.vec3d, now: wp.vec3d, radius: wp.float64
) -> wp.float64:
    """Return the fraction of a step after which a ball touches an object; inf for never.

    Both go straight. The distance to a convex body is convex along a line: search its least value,
    and from there back for the place where it falls to the radius.
    """
    shape = objects.shapes[thing]
    size = objects.sizes[thing]
    moved = moved_by(objects, env, thing)
    start = turned(objects, thing, before - (objects.places[env, thing] - moved))
    path = turned(objects, thing, now - before - moved)
    if distance_to(shape, size, start) <= radius:
        return wp.float64(0.0)
    low = wp.float64(0.0)
    high = wp.float64(1.0)
    third = wp.float64(1.0 / 3.0)
    for _ in range(_SEARCHES):
        left = low + (high - low) * third
        right = high - (high - low) * third
        if distance_to(shape, size, start + left * path) < distance_to(
            shape, size, start + right * path
        ):
            high = right
        else:
            low = left
    if distance_to(shape, size, start + high * path) > radius:
        return wp.float64(wp.inf)
    low = wp.float64(0.0)
    for _ in range(_SEARCHES):
        middle = wp.float64(0.5) * (low + high)
        if distance_to(shape, size, start + middle * path) > radius:
            low = middle
        else:
            high = middle
    return high
