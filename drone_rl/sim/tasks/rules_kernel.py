"""The rules of a task of terms as kernels: one definition for single steps and whole episodes."""

import functools
import re
from collections.abc import Iterable
from typing import Any

import warp as wp

from drone_rl.config.terms import Term
from drone_rl.sim.dynamics.moves_kernel import Fleet, camera_attitude, fly_move, is_flying, is_lost
from drone_rl.sim.dynamics.state import VELOCITY
from drone_rl.sim.rendering.devices import start_warp
from drone_rl.sim.rendering.raytrace.structs_kernel import DRONE_FRAME, PoseArrays
from drone_rl.sim.tasks.common import HIDDEN_DEPTH
from drone_rl.sim.tasks.step_kernel import Motion, Step, World, observe
from drone_rl.utils.errors import InputError

_OPTIONS = {"enable_backward": False, "fuse_fp": False}
wp.set_module_options(_OPTIONS)


RUNNING, SUCCESS = 0, 1
"""Ends of every task; the task's own follow, and then `STEP_LIMIT` and `LOST_CONTROL`."""


@wp.struct
class Episodes:
    """Environments of the fused episode kernel."""

    world: World
    drones: wp.array[wp.vec3d]
    attitudes: wp.array[wp.vec4]
    """Of drones in computer-vision mode, which keep them."""
    moves: wp.array[wp.vec3d]
    """One an action, in computer-vision mode. Metres, world frame."""
    speeds: wp.array[wp.vec4]
    """`Step.action` of each action."""
    fleet: Fleet
    steps: wp.array[int]
    end_reasons: wp.array[int]


def bound(term: Term, first: int) -> Any:  # noqa: C901 (functions that Warp compiles)
    """Return a term as a Warp function of a step and all parameters; its own begin at `first`."""
    function = wp.func(term.function)
    count = len(term.parameters)

    if count == 0:

        @wp.func
        def call(step: Step, p: wp.array[float]):  # noqa: ANN202 (a number or a truth value)
            return function(step)

    elif count == 1:

        @wp.func
        def call(step: Step, p: wp.array[float]):  # noqa: ANN202 (a number or a truth value)
            return function(step, p[first])

    elif count == 2:

        @wp.func
        def call(step: Step, p: wp.array[float]):  # noqa: ANN202 (a number or a truth value)
            return function(step, p[first], p[first + 1])

    elif count == 3:

        @wp.func
        def call(step: Step, p: wp.array[float]):  # noqa: ANN202 (a number or a truth value)
            return function(step, p[first], p[first + 1], p[first + 2])

    else:

        @wp.func
        def call(step: Step, p: wp.array[float]):  # noqa: ANN202 (a number or a truth value)
            return function(step, p[first], p[first + 1], p[first + 2], p[first + 3])

    return call


def _added(before: Any, term: Any, number: int) -> Any:
    """Return the sum of the rewards before and a further term, which is also recorded."""

    @wp.func
    def pay(world: World, env: int, step: Step) -> wp.float64:
        value = world.weights[number] * wp.float64(term(step, world.parameters))
        world.paid[env, number] = world.paid[env, number] + value
        return before(world, env, step) + value

    return pay


def _checked(before: Any, term: Any, number: int) -> Any:
    """Return the number of the first end that holds: those before, then a further term."""

    @wp.func
    def find(world: World, step: Step) -> int:
        found = int(before(world, step))
        if found == 0 and term(step, world.parameters):
            found = number
        return found

    return find


@wp.func
def _no_reward(world: World, env: int, step: Step) -> wp.float64:
    return wp.float64(0.0)


@wp.func
def _no_end(world: World, step: Step) -> int:
    return 0


@functools.cache
def make_rules(rewards: tuple[Term, ...], ends: tuple[Term, ...], success: Term) -> "Rules":
    """Return the rules of a task; compiled when they are first used."""
    return Rules(rewards, ends, success)


class Rules:
    """Kernel of single steps, and functions for the fused episode kernel; see `make_rules`."""

    def __init__(  # noqa: C901 (functions that Warp compiles)
        self, rewards: tuple[Term, ...], ends: tuple[Term, ...], success: Term
    ) -> None:
        """Fold the terms into one function."""
        first, pay, find = 0, _no_reward, _no_end
        for number, term in enumerate(rewards):
            pay = _added(pay, bound(term, first), number)
            first += len(term.parameters)
        for number, term in enumerate(ends):
            find = _checked(find, bound(term, first), SUCCESS + 1 + number)
            first += len(term.parameters)
        find = _checked(find, bound(success, first), SUCCESS)
        step_limit = SUCCESS + 1 + len(ends)
        lost_control = step_limit + 1

        @wp.func
        def advance(world: World, env: int, motion: Motion) -> wp.float64:
            """Apply all rules; write the end reason and return the reward."""
            step = observe(world, env, motion)
            reward = pay(world, env, step)
            end = int(find(world, step))
            if end == 0 and world.steps[env] >= world.step_limit:
                end = step_limit
            if motion.is_lost:
                end = lost_control
            world.end_reasons[env] = end
            return reward

        @wp.kernel(module="unique", module_options=_OPTIONS)
        def step_all(
            world: World,
            before: wp.array[wp.vec3d],
            now: wp.array[wp.vec3d],
            velocity: wp.array[wp.vec3],
            attitude: wp.array[wp.vec4],
            is_lost: wp.array[wp.bool],
            action: wp.array[wp.vec4],
            rewards: wp.array[wp.float64],
        ) -> None:
            """Apply all rules to environments, a thread each."""
            env = wp.tid()
            motion = Motion(
                before[env], now[env], velocity[env], attitude[env], is_lost[env], action[env]
            )
            rewards[env] = advance(world, env, motion)

        @wp.func
        def move(envs: Episodes, env: int, action: int) -> float:
            """Move a drone by its dynamics and apply the rules. Returns the reward."""
            motion = Motion()
            motion.before = envs.drones[env]
            motion.action = envs.speeds[action]
            if is_flying(envs.fleet):
                motion.now = fly_move(envs.fleet, env, action)
                motion.is_lost = is_lost(envs.fleet, env)
                motion.attitude = fleet_attitude(envs.fleet, env)
                motion.velocity = fleet_velocity(envs.fleet, env)
            else:
                motion.now = motion.before + envs.moves[action]
                motion.attitude = envs.attitudes[env]
            envs.drones[env] = motion.now
            return float(advance(envs.world, env, motion))

        self.step_all, self.move = step_all, move
        self._terms = (*rewards, *ends, success)

    @functools.cache  # noqa: B019 (rules are kept for ever, see `make_rules`)
    def load(self) -> None:
        """Compile the kernel of single steps, or load it, once.

        Raises:
            InputError: Warp can't compile a term; the message has its line and the reason.
        """
        start_warp("cpu")
        try:
            wp.load_module(self.step_all.module, device="cpu")
        except Exception as error:
            raise InputError(_compile_error(str(error), self._terms)) from error


def _compile_error(text: str, terms: Iterable[Term]) -> str:
    """Return one line about the innermost line of code that Warp's message names."""
    places = re.findall(r'parsing function "(.*?)" at (.*?):(\d+)', text)
    reason = text.splitlines()[-1].lstrip(";") if text else "no reason given"
    if not places:
        names = ", ".join(term.name for term in terms)
        return f"the terms {names} can't be compiled by Warp ({reason}); correct them"
    function, file, line = places[-1]
    return f"line {line} of {file}: {function} can't be compiled by Warp ({reason}); correct it"


@wp.func
def fleet_attitude(fleet: Fleet, env: int) -> wp.vec4:
    """Return the attitude of a drone in flight."""
    numbers = fleet.numbers[env]
    return wp.vec4(float(numbers[3]), float(numbers[4]), float(numbers[5]), float(numbers[6]))


@wp.func
def fleet_velocity(fleet: Fleet, env: int) -> wp.vec3:
    """Return the velocity of a drone in flight, world frame."""
    numbers = fleet.numbers[env]
    x, y, z = numbers[VELOCITY], numbers[VELOCITY + 1], numbers[VELOCITY + 2]
    return wp.vec3(float(x), float(y), float(z))


@wp.func
def place(envs: Episodes, env: int, poses: PoseArrays) -> None:
    """Write the poses of drone and objects for the renderer."""
    poses.positions[env, DRONE_FRAME] = wp.vec3(envs.drones[env])
    if is_flying(envs.fleet):
        poses.attitudes[env] = camera_attitude(envs.fleet, env)
    objects = envs.world.objects
    for i in range(objects.shapes.shape[0]):
        at = objects.places[env, i]
        if not objects.present[env, i]:
            at[2] = at[2] - wp.float64(HIDDEN_DEPTH)
        poses.positions[env, DRONE_FRAME + 1 + i] = wp.vec3(at)
