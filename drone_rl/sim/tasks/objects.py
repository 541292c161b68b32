"""Tasks whose rules are about objects: their state, and what their rules share."""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, NoReturn

import torch
import warp as wp
from torch import Tensor

from drone_rl.config.term_task import ROLES, SHAPES, ObjectSettings
from drone_rl.config.terms import REWARDS, Term, TermSettings
from drone_rl.sim.dynamics import BodyState, ComputerVision, Dynamics, FlightState, Obstacles
from drone_rl.sim.entities import VisualEntity
from drone_rl.sim.rendering.devices import on_torch_stream, start_warp
from drone_rl.sim.rendering.scene import SemanticClass
from drone_rl.sim.tasks.common import HIDDEN_DEPTH, SIDES
from drone_rl.sim.tasks.geometry_kernel import NOTHING, OBSTACLE, Objects
from drone_rl.sim.tasks.rules_kernel import Rules
from drone_rl.sim.tasks.step_kernel import World
from drone_rl.sim.tasks.task import State, Task
from drone_rl.utils.errors import InputError

_CLASSES = (SemanticClass.TARGET, SemanticClass.OBSTACLE, SemanticClass.GROUND)
_KINDS = {"ball": "sphere", "cylinder": "cylinder", "box": "box"}
_PLAIN = torch.contiguous_format
SECONDS = 0.1
"""Duration of a step of dynamics without time."""


@dataclasses.dataclass
class ObjectState(State):
    """State of N environments with P objects and G goals each. Metres, world frame."""

    places: Tensor  # (N, P, 3) float64
    """Centres of the objects."""
    present: Tensor  # (N, P) bool
    """Whether each is there."""
    touched: Tensor  # (N, P) bool
    """Whether the drone has touched it."""
    ahead: Tensor  # (N,) int32
    """Number of the object that calls for action now; -1 if none does."""
    reached: Tensor  # (N, G) bool
    """Whether each goal is reached."""
    sides: Tensor  # (N, G) int32
    """`Side` of each goal when it came up; -1 before that."""
    noted: Tensor  # (N, G) float64
    """What the task notes about it then; NaN before that."""
    action: Tensor  # (N, 4) float32
    """The last action: forward, left, up, turning left, as fractions of the greatest speed."""
    paid: Tensor  # (N, R) float64
    """Sum of each weighted reward term in this episode."""


class ObjectEntity(VisualEntity):
    """An object; its frame is at its centre. Metres."""

    def _build(self, settings: ObjectSettings, name: str) -> None:
        self.semantic_class = _CLASSES[ROLES.index(settings.role)]
        half = settings.half_size
        size = {"ball": half[:1], "cylinder": (half[0], half[2]), "box": half}[settings.shape]
        self._add_geom(_KINDS[settings.shape], size, settings.color, name)


class ObjectTask(Task[ObjectState]):
    """A task whose rules are Warp functions of objects; a subclass gives them to `__init__`."""

    strata = SIDES
    has_own_rules: ClassVar[bool] = True
    """Whether steps are those of `rules`: no subclass overrides `step`, `places` or `obstacles`."""

    def __init_subclass__(cls, **kwargs: Any) -> None:
        """Let `advance` call an overridden `step`."""
        super().__init_subclass__(**kwargs)
        if {"step", "places", "obstacles"} & vars(cls).keys():
            cls.has_own_rules = False

    def __init__(
        self,
        settings: Any,
        objects: Mapping[str, ObjectSettings],
        rules: Rules,
        *,
        rewards: Mapping[str, TermSettings],
        parameters: Sequence[float] = (),
        numbers: Sequence[float] = (),
        num_goals: int | None = None,
    ) -> None:
        """Take the objects and rules of a task.

        Args:
            settings: Of the task, with `drone_size`, `step_length` and `step_limit`.
            objects: The P objects by name.
            rules: Their rules.
            rewards: Settings of the reward terms of the rules.
            parameters: Of the ends and success of the rules, in order.
            numbers: Of the rules of contact and of what is ahead.
            num_goals: Number of goals; by default each object that is one.
        """
        self.settings, self.objects, self.rules = settings, objects, rules
        self.drone_size = settings.drone_size
        self.each = tuple(objects.values())
        """Settings of each of the P objects."""
        self.roles = torch.tensor([ROLES.index(of.role) for of in self.each], dtype=torch.int32)
        self.is_solid = bool((self.roles == OBSTACLE).any())
        self.num_goals = len(self.each) if num_goals is None else num_goals
        own = [getattr(rewards[t.name], n) for t in rules.rewards for n in t.parameters]
        weights: list[Any] = [rewards[term.name] for term in rules.rewards]
        self._weights = [float(of.weight) for of in weights]
        self._parameters, self._numbers = [*own, *parameters], [*numbers]
        self.low, self.high = (-torch.inf,) * 3, (torch.inf,) * 3
        self._arrays = dict[str, tuple[Any, ...]]()

    def make_dynamics(self) -> Dynamics:
        """Return moves of the task's length (Table 1 of Luo et al., 2018)."""
        return ComputerVision(self.settings.step_length)

    def make_props(self) -> list[ObjectEntity]:
        """Return the objects, in order."""
        return [ObjectEntity(of, name=name) for name, of in self.objects.items()]

    def begun(self, body: BodyState, places: Tensor) -> ObjectState:
        """Return states at the start of episodes, with objects at places, (N, P, 3).

        Raises:
            InputError: A term can't be compiled.
        """
        self.rules.load()
        count, device = len(places), places.device
        none = torch.zeros(count, len(self.each), dtype=torch.bool, device=device)
        goals = none.new_zeros(count, self.num_goals)
        zero = torch.zeros(count, dtype=torch.int64, device=device)
        state = ObjectState(
            body=body,
            steps=zero,
            end_reason=zero.clone(),
            places=places,
            present=~none,
            touched=none,
            ahead=torch.full((count,), NOTHING, dtype=torch.int32, device=device),
            reached=goals,
            sides=goals.int() - 1,
            noted=torch.full(goals.shape, torch.nan, dtype=torch.float64, device=device),
            action=torch.zeros(count, 4, device=device),
            paid=torch.zeros(count, len(self._weights), dtype=torch.float64, device=device),
        )
        self.look_ahead(state)
        return state

    def look_ahead(self, state: ObjectState) -> None:
        """Choose what is ahead again, in place, such as after objects have moved."""
        state.ahead[:] = NOTHING
        self._launch(state, state.drone, state.body, torch.zeros_like(state.action), True, None)

    def step(self, state: ObjectState, body: BodyState) -> tuple[ObjectState, Tensor]:
        """Apply the rules: contacts, what is ahead, rewards, ends and success."""
        return self._stepped(state, body, torch.zeros_like(state.action), None)

    def advance(
        self, state: ObjectState, body: BodyState, action: Tensor, dynamics: Dynamics
    ) -> tuple[ObjectState, Tensor]:
        """Apply the rules after an action, see `Task.advance`."""
        if not self.has_own_rules:
            return self.step(state, body)
        return self._stepped(state, body, dynamics.actions.speeds_of(action), dynamics)

    def _stepped(
        self, state: ObjectState, body: BodyState, speeds: Tensor, dynamics: Dynamics | None
    ) -> tuple[ObjectState, Tensor]:
        written = ("present", "touched", "ahead", "reached", "sides", "noted", "action", "paid")
        copies = {name: getattr(state, name).clone(memory_format=_PLAIN) for name in written}
        counts = {"steps": state.steps.clone(), "end_reason": state.end_reason.clone()}
        new = dataclasses.replace(state, body=body, **counts, **copies)
        rewards = self._launch(new, state.drone, body, speeds, False, dynamics)
        if not bool(rewards.isfinite().all()):
            self._name_unusable(new.paid)
        return new, rewards

    def _launch(
        self,
        state: ObjectState,
        before: Tensor,
        body: BodyState,
        speeds: Tensor,
        is_start: bool,
        dynamics: Dynamics | None,
    ) -> Tensor:
        """Run the rules, write the state and return the rewards."""
        device = state.places.device
        start_warp(str(device))
        count = len(state)
        counts = [state.steps.int(), state.end_reason.int()]
        rewards = torch.empty(count, dtype=torch.float64, device=device)
        flown = isinstance(body, FlightState)
        thing = body.contact.thing if flown else torch.full_like(state.steps, NOTHING)
        inputs = [
            self.world(state, *counts, dynamics),
            is_start,
            _warp(before.double(), wp.vec3d),
            _warp(body.position.double(), wp.vec3d),
            _warp(body.velocity.float(), wp.vec3),
            _warp(body.attitude.float(), wp.vec4),
            _warp(body.is_lost),
            _warp(thing.int()),
            _warp(speeds.float(), wp.vec4),
            _warp(rewards),
        ]
        with on_torch_stream(device):
            wp.launch(self.rules.step_all, count, inputs=inputs, device=str(device))
        state.steps[:], state.end_reason[:] = counts[0], counts[1]
        return rewards

    def _name_unusable(self, paid: Tensor) -> NoReturn:
        """Raise an `InputError` that names the reward terms whose values are not finite."""
        unusable = zip(self.rules.rewards, ~paid.isfinite().all(0), strict=True)
        named = ", ".join(term.name for term, is_unusable in unusable if is_unusable)
        raise InputError(
            f"task={self.name}: the reward terms {named} have values that are not finite; correct "
            "their functions, such as a division by 0 or a logarithm of it"
        )

    def world(
        self, state: ObjectState, steps: Tensor, end_reasons: Tensor, dynamics: Dynamics | None
    ) -> Any:
        """Return the rules' constants and arrays that share the memory of states.

        Steps and end reasons are int32, (N,). Without dynamics moves are done at once.
        """
        constants = self._constants(str(state.places.device))
        world: Any = World()
        objects: Any = Objects()
        objects.shapes, objects.roles, objects.sizes = constants[:3]
        objects.places = _warp(state.places, wp.vec3d)
        objects.present, objects.touched = _warp(state.present), _warp(state.touched)
        world.objects = objects
        world.low, world.high = wp.vec3d(*self.low), wp.vec3d(*self.high)
        world.radius = 0.5 * self.drone_size
        timestep = getattr(dynamics, "timestep", None)
        world.moves_at_once, world.seconds = timestep is None, timestep or SECONDS
        world.step_limit = self.settings.step_limit
        world.weights, world.parameters, world.numbers = constants[3:]
        world.goal, world.reached = _warp(state.ahead), _warp(state.reached)
        world.sides, world.noted = _warp(state.sides), _warp(state.noted)
        world.actions, world.paid = _warp(state.action, wp.vec4), _warp(state.paid)
        world.steps, world.end_reasons = _warp(steps), _warp(end_reasons)
        return world

    def _constants(self, device: str) -> tuple[Any, ...]:
        """Return shapes, roles and half sizes of objects, weights, parameters and numbers."""
        if device in self._arrays:
            return self._arrays[device]
        start_warp(device)
        shapes = torch.tensor([SHAPES.index(of.shape) for of in self.each], dtype=torch.int32)
        sizes = torch.tensor([of.half_size for of in self.each], dtype=torch.float64)
        numbers = [self._weights, self._parameters, self._numbers]
        self._arrays[device] = (
            *(_warp(of.to(device)) for of in (shapes, self.roles)),
            _warp(sizes.to(device), wp.vec3d),
            *(_warp(torch.tensor(of, dtype=torch.float64, device=device)) for of in numbers),
        )
        return self._arrays[device]

    def places(self, state: ObjectState) -> Tensor:
        """Return the objects' centres, those of absent ones under the floor."""
        hidden = (~state.present).double() * HIDDEN_DEPTH
        return state.places - torch.nn.functional.pad(hidden[..., None], (2, 0))

    def obstacles(self, state: ObjectState) -> Obstacles | None:
        """Return what is solid, if all of it is of one size."""
        solid = [i for i, of in enumerate(self.each) if of.role == "obstacle"]
        if len({self.each[i].half_size for i in solid}) != 1:
            return None
        return Obstacles(self.places(state)[:, solid], self.each[solid[0]].half_size)

    def next_number(self, state: ObjectState) -> Tensor:
        """Return the object ahead, P for none. Shape: (N,), int64."""
        ahead = state.ahead.long()
        return torch.where(ahead == NOTHING, len(self.each), ahead)


def reward_terms(rewards: Mapping[str, TermSettings]) -> tuple[Term, ...]:
    """Return the terms that settings name."""
    return tuple(REWARDS.by_name[name] for name in rewards)


def _warp(tensor: Tensor, kind: Any = None) -> Any:
    """Return a tensor as Warp's array, which shares its memory if it is contiguous."""
    return wp.from_torch(tensor.contiguous(), dtype=kind)
