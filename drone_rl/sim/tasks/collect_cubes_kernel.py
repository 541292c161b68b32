"""The rules of cube collection, as Warp functions.

The rule of contact, half of the edges of cube and drone along every axis, is here for steps, in
`common.first_contact` for paths without steps, and on purpose again in the prover.
"""

import enum

import warp as wp

from drone_rl.config.terms import Term
from drone_rl.sim.dynamics.rigid_body_kernel import Axes
from drone_rl.sim.tasks.geometry_kernel import NOTHING
from drone_rl.sim.tasks.shipped_terms_kernel import has_all_goals
from drone_rl.sim.tasks.step_kernel import Motion, Step, World, approach, side_of

wp.set_module_options({"enable_backward": False, "fuse_fp": False})


class CubesEnd(enum.IntEnum):
    """Why an episode ended."""

    RUNNING = 0
    ALL_CUBES = 1
    FRONT_BOUNDARY = 2
    SIDE_BOUNDARY = 3  # left, right, above or below
    STEP_LIMIT = 4
    LOST_CONTROL = 5


@wp.func
def touch_cubes(world: World, env: int, motion: Motion) -> Step:
    """Apply Algorithms 1 and 3: a touched cube is collected, one left behind vanishes."""
    objects = world.objects
    step = Step()
    for i in range(objects.shapes.shape[0]):
        if objects.present[env, i]:
            place = objects.places[env, i]
            reach = world.radius + objects.sizes[i][0]
            if wp.max(wp.abs(motion.now - place)) <= reach:
                objects.touched[env, i] = True
                world.reached[env, i] = True
                objects.present[env, i] = False
                step.reached += 1
            elif motion.now[0] > place[0]:
                objects.present[env, i] = False
        if not world.reached[env, i]:
            step.remaining += 1
    return step


@wp.func
def choose_first(world: World, env: int, motion: Motion, axes: Axes, step: Step) -> Step:
    """Let the first standing cube be the one ahead; note side and offset of all up to it, once."""
    objects = world.objects
    seen = approach(world, env, motion, step)
    ahead = int(NOTHING)
    for i in range(objects.shapes.shape[0]):
        if ahead == NOTHING and world.sides[env, i] < 0:
            lateral = objects.places[env, i][1] - motion.now[1]
            world.sides[env, i] = side_of(lateral, world.radius + objects.sizes[i][0])
            world.noted[env, i] = lateral
        if ahead == NOTHING and objects.present[env, i]:
            ahead = i
    world.ahead[env] = ahead
    return seen


def is_beyond_front(step: Step, bound: wp.float64 = 0.0) -> bool:  # pyright: ignore[reportArgumentType] (of Warp)
    """The drone is beyond the front boundary, metres along x."""
    return step.exact_position[0] > bound


def is_beyond_side(
    step: Step,
    side: wp.float64 = 0.0,  # pyright: ignore[reportArgumentType]
    altitude: wp.float64 = 0.0,  # pyright: ignore[reportArgumentType]
    height: wp.float64 = 0.0,  # pyright: ignore[reportArgumentType]
) -> bool:
    """The drone is beyond a boundary to its side, above or below, metres."""
    place = step.exact_position
    return wp.abs(place[1]) > side or wp.abs(place[2] - altitude) > height


ENDS = Term.of("front_boundary", is_beyond_front), Term.of("side_boundary", is_beyond_side)
"""Their parameters are those of `TaskSettings`."""
ALL_CUBES = Term.of("all_cubes", has_all_goals)
