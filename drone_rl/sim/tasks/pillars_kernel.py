"""The rules of the field of pillars, as Warp functions: R rows of K pillars, P = R K."""

import enum

import warp as wp

from drone_rl.config.terms import Term
from drone_rl.sim.dynamics.rigid_body_kernel import Axes
from drone_rl.sim.tasks.geometry_kernel import NOTHING
from drone_rl.sim.tasks.step_kernel import Motion, Step, World, side_of

wp.set_module_options({"enable_backward": False, "fuse_fp": False})


class PillarsEnd(enum.IntEnum):
    """Why an episode ended."""

    RUNNING = 0
    FINISH_LINE = 1
    PILLAR_TOUCHED = 2
    SIDE_BOUNDARY = 3
    STEP_LIMIT = 4
    LOST_CONTROL = 5


FINISH, STEP_LENGTH, SPREAD, EDGE, LINES = (wp.constant(i) for i in range(5))
"""Where `World.numbers` has x of the line, the length of a move, the field's half width, and its
half width with rounding; from `LINES` on, the x beyond which each row is passed. Metres."""


@wp.func
def _path_meets(before: wp.vec3d, now: wp.vec3d, place: wp.vec3d, reach: wp.float64) -> bool:
    """Return whether a straight path comes within `reach` of a place, along x and along y."""
    zero = wp.float64(0.0)
    enters = wp.float64(0.0)
    leaves = wp.float64(1.0)
    for axis in range(2):
        away = place[axis] - before[axis]
        path = now[axis] - before[axis]
        if path == zero:
            if wp.abs(away) > reach:
                return False
        else:
            one = (away - reach) / path
            other = (away + reach) / path
            enters = wp.max(enters, wp.min(one, other))
            leaves = wp.min(leaves, wp.max(one, other))
    return enters <= leaves


@wp.func
def touch_pillars(world: World, env: int, motion: Motion) -> Step:
    """Touch pillars on the way, and pass rows.

    In flight the drone may have bounced off a pillar between the two positions. The progress is the
    fraction of the way to the line.
    """
    objects = world.objects
    step = Step()
    for i in range(objects.shapes.shape[0]):
        if objects.present[env, i] and not objects.touched[env, i]:
            reach = world.radius + objects.sizes[i][0]
            is_met = _path_meets(motion.before, motion.now, objects.places[env, i], reach)
            if is_met or motion.thing == i:
                objects.touched[env, i] = True
                step.contact = True
    for row in range(world.reached.shape[1]):
        if motion.now[0] > world.numbers[LINES + row]:
            if not world.reached[env, row]:
                step.reached += 1
            world.reached[env, row] = True
        if not world.reached[env, row]:
            step.remaining += 1
    line = world.numbers[FINISH]
    before = wp.min(motion.before[0], line)
    step.exact_progress = (wp.min(motion.now[0], line) - before) / line
    step.distance = float(line - motion.now[0])
    step.distance_before = float(line - motion.before[0])
    return step


@wp.struct
class Way:
    """The nearest open lane of a row."""

    aside: wp.float64
    """Metres to the left of the drone."""
    gap: wp.float64
    """Width of the gap that it is in, metres; negative if no lane is open."""


@wp.func
def _y_of(world: World, env: int, pillar: int) -> wp.float64:
    """Return the y of a pillar; infinite for an absent one."""
    if world.objects.present[env, pillar]:
        return world.objects.places[env, pillar][1]
    return wp.float64(wp.inf)


@wp.func
def _is_open(world: World, env: int, row: int, y: wp.float64) -> bool:
    """Return whether a lane within the field passes a row without a touch."""
    size = world.objects.shapes.shape[0] // world.reached.shape[1]
    touch = world.radius + world.objects.sizes[0][0]
    for i in range(row * size, row * size + size):
        if wp.abs(_y_of(world, env, i) - y) <= touch:
            return False
    return y <= world.numbers[EDGE]


@wp.func
def _gap_at(world: World, env: int, row: int, y: wp.float64) -> wp.vec2d:
    """Return the y of the pillars, or of the field's ends, to the left and right of a lane."""
    size = world.objects.shapes.shape[0] // world.reached.shape[1]
    left = world.numbers[SPREAD] + world.objects.sizes[0][0]
    right = -left
    for i in range(row * size, row * size + size):
        there = _y_of(world, env, i)
        if there >= y:
            left = wp.min(left, there)
        else:
            right = wp.max(right, there)
    return wp.vec2d(left, right)


@wp.func
def _way_from(world: World, env: int, row: int, y: wp.float64, at: wp.float64) -> Way:
    """Find the nearest of the open lanes that are whole moves from `at`; see `nearest_way`."""
    step = world.numbers[STEP_LENGTH]
    edge = world.numbers[EDGE]
    first = step * wp.ceil((-edge - at) / step)
    least = wp.float64(wp.inf)
    way = Way(wp.float64(0.0), wp.float64(-1.0))
    for lane in range(int(wp.float64(2.0) * edge / step) + 1):
        offset = first + step * wp.float64(lane)
        if _is_open(world, env, row, at + offset):
            offset = offset + (at - y)
            sides = _gap_at(world, env, row, y + offset)
            off_centre = wp.abs(wp.float64(0.5) * (sides[0] + sides[1]) - y)
            spread = world.numbers[SPREAD]
            cost = wp.abs(offset) + wp.float64(1.0e-3) * off_centre / spread
            if cost < least:
                least = cost
                way.aside = offset
                way.gap = sides[0] - sides[1] - wp.float64(2.0) * world.objects.sizes[0][0]
    return way


@wp.func
def nearest_way(world: World, env: int, row: int, y: wp.float64) -> Way:
    """Find the nearest open lane of a row; of two, that whose gap's middle is nearer."""
    way = _way_from(world, env, row, y, y)
    if way.gap < wp.float64(0.0):  # in flight, between lanes: take those of the field
        step = world.numbers[STEP_LENGTH]
        way = _way_from(world, env, row, y, step * wp.rint(y / step))
    return way


@wp.func
def choose_pillar(world: World, env: int, motion: Motion, axes: Axes, step: Step) -> Step:
    """Let the next row's pillar nearest to the drone's lane be ahead; note the way of new rows."""
    rows = world.reached.shape[1]
    size = world.objects.shapes.shape[0] // rows
    y = motion.now[1]
    next_row = int(0)
    while next_row < rows and world.reached[env, next_row]:
        next_row += 1
    for row in range(rows):
        if row <= next_row and world.sides[env, row] < 0:
            way = nearest_way(world, env, row, y)
            half = wp.float64(0.5) * world.numbers[STEP_LENGTH]
            world.sides[env, row] = side_of(way.aside, half)
            world.noted[env, row] = way.gap
    ahead = int(NOTHING)
    least = wp.float64(wp.inf)
    if next_row < rows:
        for k in range(size):
            aside = wp.abs(_y_of(world, env, next_row * size + k) - y)
            if aside < least:
                least = aside
                ahead = next_row * size + k
    world.ahead[env] = ahead
    return step


def is_over_line(step: Step, finish: wp.float64 = 0.0) -> bool:  # pyright: ignore[reportArgumentType] (of Warp)
    """The drone has reached the line, metres along x."""
    return step.exact_position[0] >= finish


def is_touching(step: Step) -> bool:
    """The drone touches a pillar."""
    return step.contact


def is_beyond_side(step: Step, side: wp.float64 = 0.0) -> bool:  # pyright: ignore[reportArgumentType]
    """The drone is beside the field, metres from its middle."""
    return wp.abs(step.exact_position[1]) > side


ENDS = Term.of("pillar_touched", is_touching), Term.of("side_boundary", is_beyond_side)
"""Their parameters are those of `PillarsSettings`."""
FINISH_LINE = Term.of("finish_line", is_over_line)
