"""One step of one environment, as terms see it, and the rules that all tasks of terms share."""

import warp as wp

from drone_rl.sim.rendering.raytrace.structs_kernel import struct
from drone_rl.sim.tasks.geometry_kernel import GOAL, NOTHING, OBSTACLE, Objects, nearest, sweep

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
    """From the drone to the centre of its goal: forward, left and up as the drone is turned."""
    distance: float
    """To the centre of the goal that was ahead in this step; 0 if none was."""
    distance_before: float
    """The same before the step."""
    clearance: float
    """From the drone's surface to the nearest obstacle or the ground; negative in contact."""
    contact: bool
    """Whether it touched an obstacle or the ground on its way."""
    reached: int
    """Number of goals that it reached in this step."""
    remaining: int
    """Number of goals that are left."""
    out_of_bounds: bool
    """Whether it is outside the task's bounds."""
    action: wp.vec4
    """Forward, left, up and turning left, each as a fraction of the greatest speed."""
    last_action: wp.vec4
    """That of the step before; zero in the first one."""
    time: float
    """Seconds since the start of the episode."""


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
    step_limit: int
    weights: wp.array[wp.float64]
    """Of the reward terms."""
    parameters: wp.array[float]
    """Of all terms, one after the other."""
    goal: wp.array[int]
    """Number of the goal ahead, or `NOTHING`. Shape: (N,)."""
    sides: wp.array2d[int]
    """`Side` of each object when it became the goal ahead; -1 before that. Shape: (N, P)."""
    actions: wp.array[wp.vec4]
    """See `Step.action`; before a step, those of the step before. Shape: (N,)."""
    paid: wp.array2d[wp.float64]
    """Sum of each weighted reward term in this episode. Shape: (N, number of terms)."""
    steps: wp.array[int]
    """Taken in this episode. Shape: (N,), as of `end_reasons`."""
    end_reasons: wp.array[int]


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
    action: wp.vec4
    """See `Step.action`."""


@wp.func
def left_of(attitude: wp.vec4) -> wp.vec3:
    """Return the drone's leftward axis of a quaternion (w, x, y, z), world frame."""
    w = attitude[0]
    x = attitude[1]
    y = attitude[2]
    z = attitude[3]
    return wp.vec3(2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x))


@wp.func
def up_of(attitude: wp.vec4) -> wp.vec3:
    """Return the drone's upward axis of a quaternion (w, x, y, z), world frame."""
    w = attitude[0]
    x = attitude[1]
    y = attitude[2]
    z = attitude[3]
    return wp.vec3(2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y))


@wp.func
def choose_goal(world: World, env: int, drone: wp.vec3d, left: wp.vec3) -> None:
    """Let the nearest present goal be the one ahead, and note on which side of the drone it is."""
    found = nearest(world.objects, env, drone, GOAL)
    world.goal[env] = found.thing
    if found.thing != NOTHING and world.sides[env, found.thing] < 0:
        away = wp.vec3(world.objects.places[env, found.thing] - drone)
        aside = wp.dot(away, left)
        reach = float(world.objects.sizes[found.thing][1] + world.radius)
        side = int(1)
        if aside > reach:
            side = 0
        if aside < -reach:
            side = 2
        world.sides[env, found.thing] = side


@wp.func
def touch_all(world: World, env: int, motion: Motion) -> Step:
    """Apply the rules of contact after a motion, and return the step with what was touched.

    A goal that the drone touches on its way is reached and vanishes; an obstacle stays.
    """
    objects = world.objects
    step = Step()
    for i in range(objects.shapes.shape[0]):
        is_solid = objects.roles[i] == OBSTACLE
        if objects.present[env, i] and (is_solid or objects.roles[i] == GOAL):
            when = sweep(objects, env, i, motion.before, motion.now, world.radius)
            if when <= wp.float64(1.0):
                objects.touched[env, i] = True
                if is_solid:
                    step.contact = True
                else:
                    objects.present[env, i] = False
                    step.reached += 1
            elif not is_solid:
                step.remaining += 1
    around = nearest(objects, env, motion.now, OBSTACLE)
    step.clearance = float(wp.min(motion.now[2], around.distance) - world.radius)
    if motion.now[2] < world.radius:
        step.contact = True
    return step


@wp.func
def observe(world: World, env: int, motion: Motion) -> Step:
    """Apply the rules of contact after a motion, and return the step for the terms."""
    objects = world.objects
    step = touch_all(world, env, motion)
    left = left_of(motion.attitude)
    up = up_of(motion.attitude)
    forward = wp.cross(left, up)
    ahead = world.goal[env]
    if ahead != NOTHING:
        place = objects.places[env, ahead]
        step.distance = float(wp.length(place - motion.now))
        step.distance_before = float(wp.length(place - motion.before))
        if not objects.present[env, ahead]:
            choose_goal(world, env, motion.now, left)
            ahead = world.goal[env]
    if ahead != NOTHING:
        away = wp.vec3(objects.places[env, ahead] - motion.now)
        step.goal = wp.vec3(wp.dot(away, forward), wp.dot(away, left), wp.dot(away, up))
    step.position = wp.vec3(motion.now)
    step.velocity = motion.velocity
    step.up = up
    step.heading = wp.atan2(forward[1], forward[0])
    for axis in range(3):
        outside = motion.now[axis] < world.low[axis] or motion.now[axis] > world.high[axis]
        step.out_of_bounds = step.out_of_bounds or outside
    step.action = motion.action
    step.last_action = world.actions[env]
    world.actions[env] = motion.action
    world.steps[env] = world.steps[env] + 1
    step.time = float(world.steps[env]) * world.seconds
    return step


@wp.kernel
def begin(world: World, drones: wp.array[wp.vec3d], attitudes: wp.array[wp.vec4]) -> None:
    """Choose the first goal of episodes, a thread for each environment."""
    env = wp.tid()
    choose_goal(world, env, drones[env], left_of(attitudes[env]))
