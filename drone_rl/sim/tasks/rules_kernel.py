"""The rules of a task of terms as kernels: one definition for single steps and whole episodes."""

import functools
import itertools
import re
from typing import Any

import warp as wp

from drone_rl.config.terms import Term, TermSettings
from drone_rl.sim.dynamics.flight_kernel import four, three
from drone_rl.sim.dynamics.moves_kernel import (
    Fleet,
    along_heading,
    camera_attitude,
    fly_move,
    is_flying,
    is_lost,
    turned,
)
from drone_rl.sim.dynamics.rigid_body_kernel import axes_of
from drone_rl.sim.dynamics.state import ATTITUDE, POSITION, THING, VELOCITY
from drone_rl.sim.dynamics.velocity_kernel import Rates, fly_at, glide, rates_of, speeds_of
from drone_rl.sim.rendering.devices import start_warp
from drone_rl.sim.rendering.raytrace.structs_kernel import DRONE_FRAME, PoseArrays
from drone_rl.sim.tasks.common import HIDDEN_DEPTH
from drone_rl.sim.tasks.geometry_kernel import NOTHING, Objects
from drone_rl.sim.tasks.step_kernel import (
    Motion,
    Mover,
    Step,
    World,
    choose_nearest,
    see,
    touch_solid,
)
from drone_rl.utils.errors import InputError
from drone_rl.utils.plugins import errors_of, place_of

_OPTIONS = {"enable_backward": False, "fuse_fp": False}
wp.set_module_options(_OPTIONS)


RUNNING, SUCCESS = 0, 1
"""Ends of every task; the task's own follow, and then `STEP_LIMIT` and `LOST_CONTROL`."""


@wp.struct
class Episodes:
    """Environments of the fused episode kernel."""

    world: World
    drones: wp.array[wp.vec3d]
    attitudes: wp.array[wp.vec4d]
    """Of drones that do not fly, as what follows up to `rates`."""
    moves: wp.array[wp.vec3d]
    """See `ComputerVision.moves`."""
    turns: wp.array[wp.vec2d]
    seconds: wp.float64
    """Duration of a step at rates."""
    rates: Rates
    """Meaning of continuous actions."""
    speeds: wp.array[wp.vec4]
    """`Step.action` of each action."""
    fleet: Fleet
    steps: wp.array[int]
    end_reasons: wp.array[int]


@wp.func
def _exact(numbers: wp.array[wp.float64], i: int) -> wp.float64:
    return numbers[i]


@wp.func
def _rounded(numbers: wp.array[wp.float64], i: int) -> float:
    return float(numbers[i])


def bound(term: Term, first: int) -> Any:  # noqa: C901 (functions that Warp compiles)
    """Return a term as a Warp function of what it reads and all parameters, from `first` on."""
    place = place_of(term.function) if term.function else term.name
    with errors_of(f"the term {term.name}", place):
        function = wp.func(term.function)
    count = len(term.parameters)
    read = _exact if term.is_exact else _rounded

    if count == 0:

        @wp.func
        def call(step: Any, p: wp.array[wp.float64]):  # noqa: ANN202 (a number or a truth value)
            return function(step)

    elif count == 1:

        @wp.func
        def call(step: Any, p: wp.array[wp.float64]):  # noqa: ANN202 (a number or a truth value)
            return function(step, read(p, first))

    elif count == 2:

        @wp.func
        def call(step: Any, p: wp.array[wp.float64]):  # noqa: ANN202 (a number or a truth value)
            return function(step, read(p, first), read(p, first + 1))

    elif count == 3:

        @wp.func
        def call(step: Any, p: wp.array[wp.float64]):  # noqa: ANN202 (a number or a truth value)
            return function(step, read(p, first), read(p, first + 1), read(p, first + 2))

    else:

        @wp.func
        def call(step: Any, p: wp.array[wp.float64]):  # noqa: ANN202 (a number or a truth value)
            return function(
                step, read(p, first), read(p, first + 1), read(p, first + 2), read(p, first + 3)
            )

    return call


def _result(step: Step, value: wp.float64) -> wp.float64:
    """Return a term's value, which torch has computed; it is a parameter of each environment."""
    return value


_IN_TORCH = Term("result", _result, TermSettings, ("value",), is_exact=True)


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
        if found == 0 and bool(term(step, world.parameters)):  # a vector is an error of Warp
            found = number
        return found

    return find


def _moving(before: Any, term: Any, number: int) -> Any:
    """Return the velocity of the events before and a further one, which moves objects by number."""

    @wp.func
    def velocity(world: World, mover: Mover, event: int) -> wp.vec3:
        found = before(world, mover, event)
        if event == number:
            found = found + term(mover, world.parameters)
        return found

    return velocity


@wp.func
def _no_velocity(world: World, mover: Mover, event: int) -> wp.vec3:
    return wp.vec3()


@wp.func
def _no_reward(world: World, env: int, step: Step) -> wp.float64:
    return wp.float64(0.0)


@wp.func
def _no_end(world: World, step: Step) -> int:
    return 0


@functools.cache
def make_rules(
    rewards: tuple[Term, ...],
    ends: tuple[Term, ...],
    success: Term,
    events: tuple[tuple[int, Term], ...] = (),
    *,
    touch: Any = touch_solid,
    choose: Any = choose_nearest,
    success_first: bool = False,
) -> "Rules":
    """Return the rules of a task; compiled when they are first used.

    Args:
        rewards: Terms of the reward.
        ends: Reasons to end an episode; earlier ones precede later ones, and success.
        success: The meaning of success.
        events: What moves objects, with the number that `World.events` has for it.
        touch: Rule of contact, see `touch_solid`.
        choose: Rule of what is ahead, see `choose_nearest`.
        success_first: Whether success precedes the other ends.
    """
    return Rules(rewards, ends, success, events, touch, choose, success_first)


class Rules:
    """Kernel of single steps, and functions for the fused episode kernel; see `make_rules`."""

    def __init__(  # noqa: C901 (functions that Warp compiles)
        self,
        rewards: tuple[Term, ...],
        ends: tuple[Term, ...],
        success: Term,
        events: tuple[tuple[int, Term], ...],
        touch: Any,
        choose: Any,
        success_first: bool,
    ) -> None:
        """Fold the terms into one function."""
        self.terms = (*rewards, *ends, success, *(term for _, term in events))
        self.rewards, self.events = rewards, tuple(term for _, term in events)
        sizes = [len(term.parameters) for term in self.terms]
        *starts, total = itertools.accumulate(sizes, initial=0)
        self.in_torch = tuple(
            (term, slice(first, first + size))
            for term, first, size in zip(self.terms, starts, sizes, strict=True)
            if term.is_torch
        )
        """Terms in torch, each with its own of all parameters; their values follow all these."""
        results = itertools.count(total)
        calls = iter(
            bound(_IN_TORCH, next(results)) if term.is_torch else bound(term, first)
            for term, first in zip(self.terms, starts, strict=True)
        )
        pay, find, velocity = _no_reward, _no_end, _no_velocity
        for number in range(len(rewards)):
            pay = _added(pay, next(calls), number)
        numbers = (*range(SUCCESS + 1, SUCCESS + 1 + len(ends)), SUCCESS)
        checks = [(next(calls), number) for number in numbers]
        for number, _ in events:
            velocity = _moving(velocity, next(calls), number)
        if success_first:
            checks.insert(0, checks.pop())
        for term, number in checks:
            find = _checked(find, term, number)
        step_limit = SUCCESS + 1 + len(ends)
        lost_control = step_limit + 1

        @wp.func
        def move_objects(world: World, env: int, drone: wp.vec3d):  # noqa: ANN202 (none)
            objects = world.objects
            for i in range(world.events.shape[0]):
                mover = Mover()
                mover.place = wp.vec3(objects.places[env, i])
                mover.drone = wp.vec3(drone)
                mover.time = (float(world.steps[env]) + 0.5) * world.seconds
                mover.phase = float(world.phases[env, i])
                moved = wp.vec3d(world.seconds * velocity(world, mover, world.events[i]))
                objects.moved[env, i] = moved
                objects.places[env, i] = objects.places[env, i] + moved

        @wp.func
        def settle(world: World, env: int, step: Step, is_lost: bool) -> wp.float64:
            """Write the end reason of a step and return its reward."""
            reward = pay(world, env, step)
            end = int(find(world, step))
            if end == 0 and world.steps[env] >= world.step_limit:
                end = step_limit
            if is_lost:
                end = lost_control
            world.end_reasons[env] = end
            return reward

        @wp.func
        def show(world: World, env: int, step: Step, is_lost: bool) -> wp.float64:
            """Write a step for terms in torch, before `settle_all`."""
            world.seen[env] = step
            return wp.float64(0.0)

        finish = show if self.in_torch else settle

        @wp.kernel(module="unique", module_options=_OPTIONS)
        def settle_all(
            shown: World,
            parameters: wp.array2d[wp.float64],
            is_lost: wp.array[wp.bool],
            rewards: wp.array[wp.float64],
        ) -> None:
            """End steps that `step_all` has shown; each environment has its own parameters."""
            env = wp.tid()
            world = shown
            world.parameters = parameters[env]
            rewards[env] = settle(world, env, shown.seen[env], is_lost[env])

        @wp.kernel(module="unique", module_options=_OPTIONS)
        def move_all(world: World, before: wp.array[wp.vec3d]) -> None:
            """Move the objects of environments, before `step_all`."""
            env = wp.tid()
            move_objects(world, env, before[env])

        @wp.func
        def judge(world: World, env: int, motion: Motion) -> wp.float64:
            """Apply the rules once objects have moved; write the end, return the reward."""
            axes = axes_of(motion.attitude)
            step = see(
                world,
                env,
                motion,
                axes,
                choose(world, env, motion, axes, touch(world, env, motion)),
            )
            return finish(world, env, step, motion.is_lost)

        @wp.func
        def advance(world: World, env: int, motion: Motion) -> wp.float64:
            """Apply all rules; write the end reason and return the reward."""
            move_objects(world, env, motion.before)
            return judge(world, env, motion)

        @wp.kernel(module="unique", module_options=_OPTIONS)
        def step_all(
            constants: World,
            is_start: bool,
            places: wp.array2d[wp.vec3d],
            present: wp.array2d[wp.bool],
            touched: wp.array2d[wp.bool],
            ahead: wp.array[int],
            reached: wp.array2d[wp.bool],
            sides: wp.array2d[int],
            noted: wp.array2d[wp.float64],
            actions: wp.array[wp.vec4],
            paid: wp.array2d[wp.float64],
            steps: wp.array[int],
            end_reasons: wp.array[int],
            before: wp.array[wp.vec3d],
            now: wp.array[wp.vec3d],
            velocity: wp.array[wp.vec3],
            attitude: wp.array[wp.vec4],
            is_lost: wp.array[wp.bool],
            thing: wp.array[int],
            action: wp.array[wp.vec4],
            rewards: wp.array[wp.float64],
        ) -> None:
            """Apply rules once objects have moved, a thread each; at a start only choose a goal."""
            env = wp.tid()
            of = constants.objects
            world = World(
                Objects(
                    of.shapes, of.roles, of.sizes, of.turns, places, present, touched, of.moved
                ),
                constants.low,
                constants.high,
                constants.radius,
                constants.seconds,
                constants.moves_at_once,
                constants.step_limit,
                constants.weights,
                constants.parameters,
                constants.numbers,
                ahead,
                reached,
                sides,
                noted,
                actions,
                paid,
                steps,
                end_reasons,
                constants.events,
                constants.phases,
                constants.seen,
                constants.struck,
                constants.gaps,
                constants.hits,
                constants.paths,
            )
            motion = Motion()
            motion.before = before[env]
            motion.now = now[env]
            motion.attitude = attitude[env]
            if is_start:
                choose(world, env, motion, axes_of(motion.attitude), Step())
            else:
                motion.velocity = velocity[env]
                motion.is_lost = is_lost[env]
                motion.thing = thing[env]
                motion.action = action[env]
                rewards[env] = judge(world, env, motion)

        @wp.func
        def move(envs: Episodes, env: int, action: int) -> float:
            """Move a drone by its dynamics and apply the rules. Returns the reward."""
            motion = Motion()
            if is_flying(envs.fleet):
                fly_move(envs.fleet, env, action)
                motion = flown(envs, env)
            else:
                attitude = envs.attitudes[env]
                motion.before = envs.drones[env]
                motion.now = motion.before + along_heading(attitude, envs.moves[action])
                envs.attitudes[env] = turned(attitude, envs.turns[action])
                motion.attitude = wp.vec4(envs.attitudes[env])
                motion.thing = NOTHING
            motion.action = envs.speeds[action]
            envs.drones[env] = motion.now
            return float(advance(envs.world, env, motion))

        @wp.func
        def steer(envs: Episodes, env: int, action: wp.array[float]) -> float:
            """Do the same with a continuous action."""
            motion = Motion()
            rates = rates_of(envs.rates, action)
            if is_flying(envs.fleet):
                fly_at(envs.fleet, env, rates)
                motion = flown(envs, env)
            else:
                motion.before = envs.drones[env]
                after = glide(motion.before, envs.attitudes[env], rates, envs.seconds)
                envs.attitudes[env] = after.attitude
                motion.now = after.position
                motion.attitude = wp.vec4(after.attitude)
                motion.velocity = wp.vec3(after.velocity)
                motion.thing = NOTHING
            motion.action = speeds_of(envs.rates, action)
            envs.drones[env] = motion.now
            return float(advance(envs.world, env, motion))

        self.step_all, self.move, self.steer = step_all, move, steer
        self.move_all = move_all if events else None
        """First kernel of a step, if events move objects."""
        self.settle_all = settle_all if self.in_torch else None
        """Second kernel of a step, which reads the values of terms in torch."""

    @functools.cache  # noqa: B019 (rules are kept for ever, see `make_rules`)
    def load(self) -> None:
        """Compile the kernels of single steps, or load them, once.

        Raises:
            InputError: Warp can't compile a term; the message has its line and the reason.
        """
        start_warp("cpu")
        try:
            for kernel in filter(None, (self.move_all, self.step_all, self.settle_all)):
                wp.load_module(kernel.module, device="cpu")
        except Exception as error:
            raise InputError(self._compile_error(str(error))) from error

    def _compile_error(self, text: str) -> str:
        """Return one line about the innermost line of code that Warp's message names."""
        places = re.findall(r'parsing function "(.*?)" at (.*?):(\d+)', text)
        reason = text.splitlines()[-1].lstrip(";") if text else "no reason given"
        if places and places[-1][1] != __file__:
            function, file, line = places[-1]
            where = f"line {line} of {file}: {function}"
            return f"{where} can't be compiled by Warp ({reason}); correct it"
        for term in self.terms:  # what it returns is wrong
            own = (self.rewards, self.events)
            kind = next((i for i, terms in enumerate(own) if term in terms), len(own))
            is_own = not term.module.startswith("drone_rl.") and not term.is_torch
            if is_own and not _returns(term, kind):
                what = _VALUES[kind]
                return f"{place_of(term.function)}: no value to use ({reason}); return {what}"
        return f"the terms can't be compiled by Warp ({reason}); correct them"


_VALUES = (
    "a number, as in -> float",
    "a velocity, as in -> wp.vec3",
    "a truth value, as in -> bool",
)


def _returns(term: Term, kind: int) -> bool:
    """Return whether Warp compiles a term alone, with one of `_VALUES`."""
    call = bound(term, 0)

    @wp.kernel(module="unique", module_options=_OPTIONS)
    def pay(numbers: wp.array[wp.float64]) -> None:
        numbers[0] = wp.float64(call(Step(), numbers))

    @wp.kernel(module="unique", module_options=_OPTIONS)
    def shift(numbers: wp.array[wp.float64]) -> None:
        velocity = wp.vec3() + call(Mover(), numbers)
        numbers[0] = wp.float64(velocity[0])

    @wp.kernel(module="unique", module_options=_OPTIONS)
    def check(numbers: wp.array[wp.float64]) -> None:
        if bool(call(Step(), numbers)):
            numbers[0] = wp.float64(1.0)

    try:
        wp.load_module((pay, shift, check)[kind].module, device="cpu")
    except Exception:  # any of Warp's
        return False
    return True


@wp.func
def flown(envs: Episodes, env: int) -> Motion:
    """Return the motion of a drone that has flown, without its action."""
    numbers = envs.fleet.numbers
    motion = Motion()
    motion.before = envs.drones[env]
    motion.now = wp.vec3d(
        numbers[env, POSITION], numbers[env, POSITION + 1], numbers[env, POSITION + 2]
    )
    motion.is_lost = is_lost(envs.fleet, env)
    motion.attitude = four(numbers, env, ATTITUDE)
    motion.velocity = three(numbers, env, VELOCITY)
    motion.thing = int(numbers[env, THING])
    return motion


@wp.func
def place(envs: Episodes, env: int, poses: PoseArrays) -> None:
    """Write the poses of drone and objects for the renderer."""
    poses.positions[env, DRONE_FRAME] = wp.vec3(envs.drones[env])
    if is_flying(envs.fleet):
        poses.attitudes[env] = camera_attitude(envs.fleet, env)
    else:
        poses.attitudes[env] = wp.vec4(envs.attitudes[env])
    objects = envs.world.objects
    for i in range(objects.shapes.shape[0]):
        at = objects.places[env, i]
        if not objects.present[env, i]:
            at[2] = at[2] - wp.float64(HIDDEN_DEPTH)
        poses.positions[env, DRONE_FRAME + 1 + i] = wp.vec3(at)
