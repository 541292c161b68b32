"""One step of one environment, as terms see it, and the rules of tasks whose goals are objects."""

import warp as wp

from drone_rl.sim.dynamics.rigid_body_kernel import Axes
from drone_rl.sim.rendering.raytrace.structs_kernel import struct
from drone_rl.sim.scenes.path_kernel import Paths, path_length
from drone_rl.sim.tasks.geometry_kernel import (
    BODY,
    DECORATION,
    GOAL,
    NOTHING,
    OBSTACLE,
    Objects,
    moved_by,
    nearest,
    sweep,
)

wp.set_module_options({"enable_backward": False, "fuse_fp": False})


@struct
class Step:
    """A step of one environment: what terms read. SI units; the drone is a ball."""

    position: wp.vec3
    """World frame, after the step, as all that follows."""
    velocity: wp.vec3
    """World frame; in computer-vision mode the move over the step's time."""
    up: wp.vec3
    """The drone's own upward axis, world frame."""
    heading: float
    """To the left of the world's x, radians."""
    goal: wp.vec3
    """From the drone to its goal's centre: forward, left and up as the drone is turned.

    In `pillars` to that of the nearest pillar of the next row.
    """
    distance: float
    """To the centre of the goal that was ahead in this step; 0 if none was."""
    distance_before: float
    """The same before the step."""
    clearance: float
    """From the drone's surface to what is nearest and solid; negative in contact.

    That are obstacles and the ground, or what is solid in a scene file.
    """
    contact: bool
    """Whether it touched an obstacle, the ground or the scene on its way."""
    reached: int
    """Number of goals that it reached in this step."""
    remaining: int
    """Number of goals that it has not reached."""
    out_of_bounds: bool
    """Whether it is outside the task's bounds."""
    action: wp.vec4
    """Forward, left, up and turning left, each as a fraction of the greatest speed."""
    last_action: wp.vec4
    """That of the step before; zero in the first one."""
    time: float
    """Seconds since the start of the episode."""
    exact_position: wp.vec3d
    """`position` in double precision."""
    exact_progress: wp.float64
    """`distance_before` minus `distance` in double precision, or what the task counts instead."""


@struct
class Mover:
    """An object that an event moves, and the time. SI units, world frame."""

    place: wp.vec3
    """Its centre before the step."""
    drone: wp.vec3
    """Where the drone is before the step."""
    time: float
    """Seconds from the start of the episode to the middle of the step."""
    phase: float
    """A random number in [0, 1), one for each object and episode."""


@wp.struct
class World:
    """Constants of a task, and states of N environments that its rules read and write."""

    objects: Objects
    low: wp.vec3d
    high: wp.vec3d
    """Bounds of the drone's centre."""
    radius: wp.float64
    """Of the drone."""
    seconds: float
    """Duration of a step."""
    moves_at_once: bool
    """Whether drones have no velocity of their own."""
    step_limit: int
    weights: wp.array[wp.float64]
    """Of the reward terms."""
    parameters: wp.array[wp.float64]
    """Of all terms, one after the other."""
    numbers: wp.array[wp.float64]
    """Constants of the task's own rules."""
    ahead: wp.array[int]
    """Number of the object ahead: the goal, or what must be passed; or `NOTHING`. Shape: (N,)."""
    reached: wp.array2d[wp.bool]
    """Whether each of G goals is reached. Shape: (N, G), as of what follows."""
    sides: wp.array2d[int]
    """`Side` of each goal when it became the one ahead; -1 before that."""
    noted: wp.array2d[wp.float64]
    """What the task notes about it then; NaN before that."""
    actions: wp.array[wp.vec4]
    """See `Step.action`; before a step, those of the step before. Shape: (N,)."""
    paid: wp.array2d[wp.float64]
    """Sum of each weighted reward term in this episode. Shape: (N, number of terms)."""
    steps: wp.array[int]
    """Taken in this episode. Shape: (N,), as of `end_reasons`."""
    end_reasons: wp.array[int]
    events: wp.array[int]
    """Number of what moves each object; -1 for nothing. Shape: (P,), or no array if all stay."""
    phases: wp.array2d[wp.float64]
    """See `Mover.phase`. Shape: (N, P), or no array."""
    seen: wp.array[Step]
    """The last step, for terms in torch. Shape: (N,), or no array if there are none."""
    struck: wp.array[wp.bool]
    """Whether each drone touched a scene's solids in this step. Shape: (N,), as of what follows.

    No array over bare ground.
    """
    gaps: wp.array[wp.float64]
    """Distance from each drone's centre to the nearest solid, after the step."""
    hits: wp.array2d[wp.float64]
    """Fraction of the step after which each object that is a scene's body was touched; inf for
    never. Shape: (N, P), or no array if there are none."""
    paths: Paths
    """To goals at sites of scenes; no arrays if there are none."""


@wp.struct
class Motion:
    """What a drone's dynamics did in a step. SI units, world frame."""

    before: wp.vec3d
    now: wp.vec3d
    velocity: wp.vec3
    attitude: wp.vec4
    """Quaternion (w, x, y, z)."""
    is_lost: bool
    """Whether its motion has diverged."""
    thing: int
    """Number of the obstacle that it last hit in flight; negative for none."""
    action: wp.vec4
    """See `Step.action`."""


# The rules of a task whose goals are objects: what is touched, and which goal is ahead


@wp.func
def _touches(world: World, env: int, thing: int, motion: Motion) -> bool:
    """Return whether a drone touches an obstacle or a goal on its way."""
    objects = world.objects
    when = wp.float64(wp.inf)
    if objects.present[env, thing] and objects.roles[thing] != DECORATION:
        if objects.shapes[thing] == BODY:
            when = world.hits[env, thing]
        else:
            when = sweep(objects, env, thing, motion.before, motion.now, world.radius)
    return when <= wp.float64(1.0)


@wp.func
def touch_solid(world: World, env: int, motion: Motion) -> Step:
    """Apply the rules of contact after a motion, and return the step with what was touched.

    A goal that the drone touches on its way is reached and vanishes; an obstacle stays.
    """
    objects = world.objects
    step = Step()
    for i in range(objects.shapes.shape[0]):
        is_solid = objects.roles[i] == OBSTACLE
        if _touches(world, env, i, motion):
            objects.touched[env, i] = True
            if is_solid:
                step.contact = True
            else:
                objects.present[env, i] = False
                world.reached[env, i] = True
                step.reached += 1
        if objects.roles[i] == GOAL and not world.reached[env, i]:
            step.remaining += 1
    if world.struck.shape[0] > 0:
        step.contact = step.contact or world.struck[env]
    elif motion.now[2] < world.radius:
        step.contact = True
    return step


@wp.func
def side_of(aside: wp.float64, tolerance: wp.float64) -> int:
    """Return the `Side` of metres to the left."""
    side = int(1)
    if aside > tolerance:
        side = 0
    if aside < -tolerance:
        side = 2
    return side


@wp.func
def approach(world: World, env: int, motion: Motion, step: Step) -> Step:
    """Return the step with its distances to the goal that was ahead."""
    seen = step
    ahead = world.ahead[env]
    if ahead != NOTHING:
        place = world.objects.places[env, ahead]
        now = wp.length(place - motion.now)
        before = wp.length(place - moved_by(world.objects, env, ahead) - motion.before)
        seen.distance = float(now)
        seen.distance_before = float(before)
        seen.exact_progress = before - now
    return seen


@wp.func
def choose_nearest(world: World, env: int, motion: Motion, axes: Axes, step: Step) -> Step:
    """Let the nearest goal be the one ahead once the last one is gone, and note its side."""
    seen = approach(world, env, motion, step)
    ahead = world.ahead[env]
    is_gone = ahead == NOTHING
    if not is_gone:
        is_gone = not world.objects.present[env, ahead]
    if is_gone:
        found = nearest(world.objects, env, motion.now, GOAL)
        ahead = found.thing
        world.ahead[env] = ahead
        if ahead != NOTHING and world.sides[env, ahead] < 0:
            aside = wp.dot(world.objects.places[env, ahead] - motion.now, wp.vec3d(axes.left))
            reach = world.objects.sizes[ahead][1] + world.radius
            world.sides[env, ahead] = side_of(aside, reach)
            world.noted[env, ahead] = aside
    return seen


@wp.func
def choose_on_path(world: World, env: int, motion: Motion, axes: Axes, step: Step) -> Step:
    """Do the same with progress along the shortest path through free space."""
    ahead = world.ahead[env]
    seen = choose_nearest(world, env, motion, axes, step)
    if ahead != NOTHING:
        route = int(world.paths.numbers[env, ahead])
        if route >= 0:
            place = world.objects.places[env, ahead]
            seen.exact_progress = path_length(
                world.paths, route, place, motion.before
            ) - path_length(world.paths, route, place, motion.now)
    return seen


@wp.func
def see(world: World, env: int, motion: Motion, axes: Axes, step: Step) -> Step:
    """Return the step with the drone's pose, clearance and action; count it."""
    seen = step
    objects = world.objects
    ahead = world.ahead[env]
    if ahead != NOTHING:
        away = wp.vec3(objects.places[env, ahead] - motion.now)
        seen.goal = wp.vec3(
            wp.dot(away, axes.forward), wp.dot(away, axes.left), wp.dot(away, axes.up)
        )
    ground = motion.now[2]
    if world.gaps.shape[0] > 0:
        ground = world.gaps[env]
    around = nearest(objects, env, motion.now, OBSTACLE)
    seen.clearance = float(wp.min(ground, around.distance) - world.radius)
    seen.exact_position = motion.now
    seen.position = wp.vec3(motion.now)
    seen.velocity = motion.velocity
    if world.moves_at_once:
        seen.velocity = wp.vec3(motion.now - motion.before) / world.seconds
    seen.up = axes.up
    seen.heading = wp.atan2(axes.forward[1], axes.forward[0])
    for axis in range(3):
        outside = motion.now[axis] < world.low[axis] or motion.now[axis] > world.high[axis]
        seen.out_of_bounds = seen.out_of_bounds or outside
    seen.action = motion.action
    seen.last_action = world.actions[env]
    world.actions[env] = motion.action
    world.steps[env] = world.steps[env] + 1
    seen.time = float(world.steps[env]) * world.seconds
    return seen
