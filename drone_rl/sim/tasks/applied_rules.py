"""Rules of tasks of objects with their numbers, applied to states."""

from collections.abc import Mapping, Sequence
from typing import Any

import torch
import warp as wp
from torch import Tensor

from drone_rl.config.term_task import ROLES, SHAPES, ObjectSettings
from drone_rl.config.terms import REWARDS, Term, TermSettings
from drone_rl.sim.dynamics import Dynamics, FlightState
from drone_rl.sim.rendering.devices import on_torch_stream, start_warp
from drone_rl.sim.scenes.path_kernel import Route, make_paths
from drone_rl.sim.tasks.geometry_kernel import BODY, NOTHING, Objects
from drone_rl.sim.tasks.rules_kernel import Rules
from drone_rl.sim.tasks.step_kernel import Step, World
from drone_rl.sim.tasks.torch_terms import values_of
from drone_rl.utils.errors import InputError

SECONDS = 0.1
"""Duration of a step of dynamics without time."""
WRITTEN = ("present", "touched", "ahead", "reached", "sides", "noted", "action", "paid")
"""Fields of states that rules write, besides counts, in the order of the kernel's arguments."""


class AppliedRules:
    """Compiled rules, and the constants that they read."""

    def __init__(
        self,
        rules: Rules,
        settings: Any,
        objects: Sequence[ObjectSettings],
        *,
        rewards: Mapping[str, TermSettings],
        parameters: Sequence[float] = (),
        numbers: Sequence[float] = (),
        low: Sequence[float] = (-torch.inf,) * 3,
        high: Sequence[float] = (torch.inf,) * 3,
        events: Sequence[int] = (),
        routes: Sequence[Route] = (),
    ) -> None:
        """Take rules and their numbers.

        Args:
            rules: The compiled rules.
            settings: Of the task, with `drone_size` and `step_limit`.
            objects: The P objects.
            rewards: Settings of their reward terms.
            parameters: Of their ends, success and events, in order.
            numbers: Of their rules of contact and of what is ahead.
            low: Least coordinates within the task's bounds, metres.
            high: Largest ones.
            events: See `World.events`.
            routes: To goals at sites of scenes.
        """
        self.compiled, self._settings, self._objects = rules, settings, objects
        own = [getattr(rewards[t.name], n) for t in rules.rewards for n in t.parameters]
        weights: list[Any] = [rewards[term.name] for term in rules.rewards]
        self._lists = [[float(of.weight) for of in weights], [*own, *parameters], [*numbers]]
        self._bounds = wp.vec3d(*low), wp.vec3d(*high)
        self._events, self._routes = events, routes
        self.written = (*WRITTEN, "places") if events else WRITTEN
        """Fields of states that rules write, besides counts."""
        self._kept = dict[tuple[str, float | None], Any]()
        self._paths = dict[str, Any]()

    def begin(self, state: Any) -> None:
        """Choose what is ahead in states, `ObjectState`, in place."""
        self._run(state, state.drone, torch.zeros_like(state.action), None, is_start=True)

    def move(self, state: Any, before: Tensor, dynamics: Dynamics | None) -> Tensor | None:
        """Let events move objects in states, in place, and return by how much, (N, P, 3).

        `before` is where the drones were, metres, (N, 3). Without events nothing moves: None.
        """
        if not self._events:
            return None
        device = state.places.device
        steps, end_reasons = state.steps.int(), state.end_reason.int()
        world = self.world(state, steps, end_reasons, dynamics)
        moved = torch.zeros_like(state.places)
        world.objects = _with_moved(world.objects, moved)
        inputs = [world, _ctype(before.double(), wp.vec3d)]
        with on_torch_stream(device):
            wp.launch(self.compiled.move_all, len(state), inputs=inputs, device=str(device))
        return moved

    def step(
        self,
        state: Any,
        before: Tensor,
        speeds: Tensor,
        dynamics: Dynamics | None,
        around: tuple[Tensor, ...] | None = None,
        moved: Tensor | None = None,
    ) -> Tensor:
        """Write states after drones have moved, and return the rewards.

        Args:
            state: States, `ObjectState`, whose drones have moved, with contiguous tensors.
            before: Where the drones were, metres. Shape: (N, 3).
            speeds: See `Step.action`. Shape: (N, 4).
            dynamics: What moved the drones; None for moves that are done at once.
            around: In scenes, `World.struck` and `World.gaps`, with bodies also `World.hits`.
            moved: By how much objects have moved before; see `move`.

        Raises:
            InputError: A reward term or an event is not finite.
        """
        rewards = self._run(state, before, speeds, dynamics, around, moved, is_start=False)
        self.check(state)
        return rewards

    def _run(
        self,
        state: Any,
        before: Tensor,
        speeds: Tensor,
        dynamics: Dynamics | None,
        around: tuple[Tensor, ...] | None = None,
        moved: Tensor | None = None,
        *,
        is_start: bool,
    ) -> Tensor:
        body = state.body
        device = state.places.device
        start_warp(str(device))
        count = len(state)
        steps, end_reasons = state.steps.int(), state.end_reason.int()
        rewards = torch.empty(count, dtype=torch.float64, device=device)
        flown = isinstance(body, FlightState)
        thing = body.contact.thing if flown else torch.full_like(state.steps, NOTHING)
        timestep = getattr(dynamics, "timestep", None)
        world = self._constants(state, timestep, is_kept=around is None)
        if around is not None:
            for name, values in zip(("struck", "gaps", "hits"), around, strict=False):
                setattr(world, name, _warp(values))
        if moved is not None:
            world.objects = _with_moved(world.objects, moved)
        inputs = [
            world,
            is_start,
            _ctype(state.places, wp.vec3d),
            *(_ctype(getattr(state, n), wp.vec4 if n == "action" else None) for n in WRITTEN),
            *map(_ctype, (steps, end_reasons)),
            *(_ctype(of.double(), wp.vec3d) for of in (before, body.position)),
            _ctype(body.velocity.float(), wp.vec3),
            _ctype(body.attitude.float(), wp.vec4),
            *map(_ctype, (body.is_lost, thing.int())),
            _ctype(speeds, wp.vec4),
            _ctype(rewards),
        ]
        with on_torch_stream(device):
            wp.launch(self.compiled.step_all, count, inputs=inputs, device=str(device))
            if self.compiled.settle_all is not None and not is_start:
                world.paid = _warp(state.paid)
                world.steps, world.end_reasons = _warp(steps), _warp(end_reasons)
                rest = [self._each_parameters(world.seen, device), body.is_lost, rewards]
                inputs = [world, *map(_ctype, rest)]
                wp.launch(self.compiled.settle_all, count, inputs=inputs, device=str(device))
        state.steps[:], state.end_reason[:] = steps, end_reasons
        return rewards

    def _each_parameters(self, seen: Any, device: torch.device) -> Tensor:
        """Return the parameters of each environment, then its values of the terms in torch."""
        given = self._lists[1]
        every = torch.tensor(given, dtype=torch.float64, device=device).expand(len(seen), -1)
        values = [values_of(term, seen, given[own], device) for term, own in self.compiled.in_torch]
        return torch.cat([every, torch.stack(values, -1)], -1)

    def check(self, state: Any) -> None:
        """Raise an `InputError` that names the terms whose sums in states are not finite."""
        if self._events and not bool(state.places.isfinite().all()):
            names = ", ".join(term.name for term in self.compiled.events)
            raise InputError(
                f"the events {names} return velocities that are not finite; correct them"
            )
        if bool(state.paid.isfinite().all()):
            return
        unusable = zip(self.compiled.rewards, ~state.paid.isfinite().all(0), strict=True)
        names = [term.name for term, is_unusable in unusable if is_unusable]
        raise InputError(
            f"the reward terms {', '.join(names)} have values that are not finite, also with a "
            "weight of 0; correct their functions, such as a division by 0 or a logarithm of it, "
            f"or leave them out: task.reward.{names[0]}=null"
        )

    def world(
        self, state: Any, steps: Tensor, end_reasons: Tensor, dynamics: Dynamics | None
    ) -> Any:
        """Return the rules' constants and arrays that share the memory of states.

        Steps and end reasons are int32, (N,). Without dynamics moves are done at once.
        """
        device, timestep = str(state.places.device), getattr(dynamics, "timestep", None)
        world = self._make_constants(device, timestep)
        self._prepare_events(world, state)
        self._prepare_paths(world, state)
        objects: Any = world.objects
        objects.places = _warp(state.places, wp.vec3d)
        objects.present, objects.touched = _warp(state.present), _warp(state.touched)
        world.objects = objects
        world.ahead, world.reached = _warp(state.ahead), _warp(state.reached)
        world.sides, world.noted = _warp(state.sides), _warp(state.noted)
        world.actions, world.paid = _warp(state.action, wp.vec4), _warp(state.paid)
        world.steps, world.end_reasons = _warp(steps), _warp(end_reasons)
        return world

    def _constants(self, state: Any, timestep: float | None, *, is_kept: bool) -> Any:
        """Return the rules' constants, with no more of states than events and routes need."""
        key = device, _ = str(state.places.device), timestep
        if key not in self._kept:
            self._kept[key] = self._make_constants(*key)
        if not (self._routes or self._events or self.compiled.in_torch) and is_kept:
            return self._kept[key]
        world: Any = World()
        world.assign(self._kept[key])
        self._prepare_events(world, state)
        self._prepare_paths(world, state)
        if self.compiled.in_torch:
            world.seen = wp.zeros(len(state), dtype=Step, device=device)
        return world

    def _prepare_events(self, world: Any, state: Any) -> None:
        """Give the phases of states, whose memory they share, and the room for displacements."""
        if self._events:
            events = torch.tensor(self._events, dtype=torch.int32, device=state.places.device)
            world.events = _warp(events)
            world.phases = wp.from_torch(state.sampled[:, -len(self._events) :])
            world.objects = _with_moved(world.objects, torch.zeros_like(state.places))

    def _prepare_paths(self, world: Any, state: Any) -> None:
        """Give the routes, with those of states, whose memory they share."""
        if self._routes:
            device, count = str(state.places.device), len(self._objects)
            if device not in self._paths:
                self._paths[device] = make_paths(self._routes, device)
            paths = self._paths[device]
            after = count if self._events else 0
            numbers = state.sampled[:, state.sampled.shape[1] - count - after :][:, :count]
            paths.numbers = wp.from_torch(numbers)
            world.paths = paths

    def _make_constants(self, device: str, timestep: float | None) -> Any:
        start_warp(device)
        world, objects = World(), Objects()
        kinds = [int(BODY) if of.body else SHAPES.index(of.shape) for of in self._objects]
        shapes = torch.tensor(kinds, dtype=torch.int32)
        sizes = torch.tensor([of.half_size for of in self._objects], dtype=torch.float64)
        roles = torch.tensor([ROLES.index(of.role) for of in self._objects], dtype=torch.int32)
        objects.shapes, objects.roles = _warp(shapes.to(device)), _warp(roles.to(device))
        objects.sizes = _warp(sizes.to(device), wp.vec3d)
        angles = torch.tensor([of.heading for of in self._objects], dtype=torch.float64).deg2rad()
        turns = torch.stack([angles.cos(), angles.sin()], -1)
        objects.turns = _warp(turns.to(device), wp.vec2d)
        world.objects = objects
        world.low, world.high = self._bounds
        world.radius = 0.5 * self._settings.drone_size
        world.moves_at_once, world.seconds = timestep is None, timestep or SECONDS
        world.step_limit = self._settings.step_limit
        world.weights, world.parameters, world.numbers = (
            _warp(torch.tensor(of, dtype=torch.float64, device=device)) for of in self._lists
        )
        return world


def reward_terms(rewards: Mapping[str, TermSettings]) -> tuple[Term, ...]:
    """Return the terms that settings name."""
    return tuple(REWARDS.by_name[name] for name in rewards)


def largest_reward(rewards: Mapping[str, Any], **largest: float) -> float | None:
    """Return the weighted sum of the terms' largest sums in an episode; None if one is unknown.

    Without any contact that of `contact` is 0.
    """
    known = {"contact": 0.0, **largest}
    weights = {name: of.weight for name, of in rewards.items() if of.weight}
    if weights.keys() - known:
        return None
    return float(sum(weight * known[name] for name, weight in weights.items()))


def _with_moved(objects: Any, moved: Tensor) -> Any:
    """Return objects with the array of their movements in a step."""
    objects.moved = _warp(moved, wp.vec3d)
    return objects


def _warp(tensor: Tensor, kind: Any = None) -> Any:
    """Return a tensor as Warp's array, which shares its memory if it is contiguous."""
    return wp.from_torch(tensor.contiguous(), dtype=kind)


def _ctype(tensor: Tensor, kind: Any = None) -> Any:
    """Return a tensor as an argument of a kernel, which is made faster than an array."""
    return wp.from_torch(tensor.contiguous(), dtype=kind, return_ctype=True)
