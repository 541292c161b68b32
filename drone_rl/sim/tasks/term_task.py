"""The task that is made of terms: objects, starts, rewards, ends and success."""

import dataclasses
import enum
import functools
import math
from collections.abc import Mapping
from typing import Any, NoReturn

import numpy as np
import torch
import warp as wp
from torch import Tensor

from drone_rl.config import CameraSettings
from drone_rl.config.terms import ENDS, REWARDS, SUCCESSES
from drone_rl.sim.actions import Entry, Move
from drone_rl.sim.dynamics import BodyState, ComputerVision, Dynamics, Quadrotor
from drone_rl.sim.dynamics.state import FlightState
from drone_rl.sim.entities import VisualEntity
from drone_rl.sim.rendering.devices import start_warp
from drone_rl.sim.rendering.scene import SemanticClass
from drone_rl.sim.tasks import shipped_terms_kernel as shipped_terms_kernel  # registers them
from drone_rl.sim.tasks.common import HIDDEN_DEPTH, SIDES, Side, place_in_view, side_of
from drone_rl.sim.tasks.fused import FusedTerms
from drone_rl.sim.tasks.geometry_kernel import GOAL, NOTHING, OBSTACLE, Objects
from drone_rl.sim.tasks.rules_kernel import SUCCESS, make_rules
from drone_rl.sim.tasks.step_kernel import World, begin
from drone_rl.sim.tasks.task import Goals, Grid, State, Task, register_task
from drone_rl.sim.tasks.term_settings import ROLES, SHAPES, ObjectSettings, TermTaskSettings
from drone_rl.sim.vocabulary import TaskVocabulary
from drone_rl.utils.errors import InputError

_CLASSES = (SemanticClass.TARGET, SemanticClass.OBSTACLE, SemanticClass.GROUND)
_KINDS = {"ball": "sphere", "cylinder": "cylinder", "box": "box"}
_MOST_TRIES = 1000
"""Largest number of samples of a place until one keeps away from the objects before it."""
_LAST_ENDS = ("STEP_LIMIT", "LOST_CONTROL")
_SECONDS = 0.1
"""Duration of a step of dynamics without time."""


@dataclasses.dataclass
class ObjectState(State):
    """State of N environments with P objects each. Metres, world frame."""

    places: Tensor  # (N, P, 3) float64
    """Centres of the objects."""
    present: Tensor  # (N, P) bool
    """Whether each is there; reached goals are not."""
    touched: Tensor  # (N, P) bool
    """Whether the drone has touched it."""
    goal: Tensor  # (N,) int32
    """Number of the goal ahead; -1 if none is left."""
    sides: Tensor  # (N, P) int32
    """`Side` of each goal when it became the one ahead; -1 before that."""
    action: Tensor  # (N, 4) float32
    """The last action: forward, left, up, turning left, as fractions of the greatest speed."""
    paid: Tensor  # (N, R) float64
    """Sum of each weighted reward term in this episode."""


class ObjectEntity(VisualEntity):
    """An object of a task of terms; its frame is at its centre. Metres."""

    def _build(self, settings: ObjectSettings, name: str) -> None:
        self.semantic_class = _CLASSES[ROLES.index(settings.role)]
        half = settings.half_size
        size = {"ball": half[:1], "cylinder": (half[0], half[2]), "box": half}[settings.shape]
        self._add_geom(_KINDS[settings.shape], size, settings.color, name)


class TermTask(Task[ObjectState]):
    """A task of terms: every rule is that of its settings; see `define_task`."""

    success_end = SUCCESS
    strata = SIDES
    observed = ("reached", "end_reason")
    scored = ("reached", "sides", "places")
    remembered: Mapping[str, str] = {
        "places": "centres of the objects, metres (T, P, 3)",
        "present": "whether each object is there, bool (T, P)",
        "touched": "whether the drone has touched each object, bool (T, P)",
        "next_target": "number of the goal ahead, P if none is left (T,)",
    }

    def __init__(self, settings: TermTaskSettings) -> None:
        """Take the settings of a task of terms."""
        self.settings = s = settings
        self.name = s.name
        self.drone_size = s.drone_size
        x, y, z = (sum(s.start.range_of(axis)) / 2 for axis in "xyz")
        self.origin = (x, y, z)
        self.each = [of for of in s.objects.values() for _ in range(of.count)]
        """Settings of each of the P objects."""
        self.roles = torch.tensor([ROLES.index(of.role) for of in self.each])
        self._rewards = tuple(REWARDS.by_name[name] for name in s.reward)
        self._ends = tuple(ENDS.by_name[name] for name in s.end)
        (success,) = (SUCCESSES.by_name[name] for name in s.success)
        own = [term.name.upper() for term in self._ends]
        ends: Any = enum.IntEnum("End", ["RUNNING", "SUCCESS", *own, *_LAST_ENDS], start=0)
        self.ends = ends
        self.truncation = self.expected_end = self.ends["STEP_LIMIT"]
        self.rules = make_rules(self._rewards, self._ends, success)
        self._success = success
        self.vocabulary = TaskVocabulary(tested=f"scenes of the task {s.name}")

    @property
    def goals(self) -> Tensor:
        """Numbers of the objects that are goals. Shape: (G,)."""
        return (self.roles == GOAL).nonzero()[:, 0]

    @property
    def entries(self) -> Mapping[str, Entry]:
        """See `ObjectState`; "reached" and "sides" are of the goals alone."""
        objects, goals = len(self.each), len(self.goals)
        return {
            "reached": Entry((goals,), torch.bool),
            "sides": Entry((goals,), torch.int64, -1, len(Side) - 1),
            "places": Entry((objects, 3), torch.float32),
            "present": Entry((objects,), torch.bool),
            "touched": Entry((objects,), torch.bool),
            "goal": Entry((1,), torch.int64, 0, objects),
            "paid": Entry((len(self._rewards),), torch.float32),
            "end_reason": Entry((1,), torch.int64, 0, len(self.ends) - 1),
        }

    def make_dynamics(self) -> Dynamics:
        """Return moves of the task's length."""
        return ComputerVision(self.settings.step_length)

    def make_props(self) -> list[ObjectEntity]:
        """Return the objects, in order."""
        return [
            ObjectEntity(of, name=f"{name}_{i}" if of.count > 1 else name)
            for name, of in self.settings.objects.items()
            for i in range(of.count)
        ]

    # Reset and rules

    def sample(self, random_state: np.random.RandomState) -> Tensor:
        """Sample x, y, z (m) and heading (rad) of the start, then the centres. Shape: (4 + 3 P,).

        Raises:
            InputError: A region has no room left for an object.
        """
        s = self.settings
        *start, heading = (
            random_state.uniform(*s.start.range_of(axis)) for axis in ("x", "y", "z", "heading")
        )
        placed: list[Any] = []
        names = [name for name, of in s.objects.items() for _ in range(of.count)]
        for name, of in zip(names, self.each, strict=True):
            for _ in range(_MOST_TRIES):
                place = np.array([random_state.uniform(*of.range_of(axis)) for axis in "xyz"])
                if self._has_room(of, place, placed, start):
                    break
            else:
                raise InputError(
                    f"task.objects.{name}: found no room in {_MOST_TRIES} tries that keeps "
                    f"{of.apart:g} m from other objects and {s.start.apart:g} m from the start; "
                    "give a larger range of x or y, a smaller apart, or fewer objects"
                )
            placed.append((of, place))
        places = np.concatenate([[*start, math.radians(heading)], *(p for _, p in placed)])
        return torch.from_numpy(places)

    def _has_room(self, of: ObjectSettings, place: Any, placed: list[Any], start: Any) -> bool:
        """Return whether boxes around an object, the ones before it and the drone keep apart."""
        s = self.settings
        half, drone = np.array(of.half_size), np.array(start)
        if of.role != "decoration":
            gap = np.abs(place - drone) - half - 0.5 * s.drone_size
            if np.linalg.norm(gap.clip(0)) <= s.start.apart:
                return False
        gaps = (np.abs(place - other) - half - np.array(o.half_size) for o, other in placed)
        return of.apart == 0 or all(np.linalg.norm(gap.clip(0)) >= of.apart for gap in gaps)

    def start(self, sampled: Tensor, body: BodyState) -> ObjectState:
        """Return initial states; see `sample`.

        Raises:
            InputError: A term can't be compiled.
        """
        self.rules.load()
        count, objects = len(sampled), len(self.each)
        half = 0.5 * sampled[:, 3]
        zero = torch.zeros_like(half)
        attitude = torch.stack([half.cos(), zero, zero, half.sin()], -1)
        none = torch.zeros(count, objects, dtype=torch.bool)
        state = ObjectState(
            body=body.moved(sampled[:, :3].clone(), attitude),
            steps=torch.zeros(count, dtype=torch.int64),
            end_reason=torch.zeros(count, dtype=torch.int64),
            places=sampled[:, 4:].reshape(count, objects, 3).clone(),
            present=~none,
            touched=none,
            goal=torch.full((count,), NOTHING, dtype=torch.int32),
            sides=torch.full((count, objects), -1, dtype=torch.int32),
            action=torch.zeros(count, 4),
            paid=torch.zeros(count, len(self._rewards), dtype=torch.float64),
        )
        return self._with_goal(state)

    def _with_goal(self, state: ObjectState) -> ObjectState:
        """Let the nearest present goal be the one ahead, in place."""
        start_warp("cpu")
        steps = torch.zeros(2, len(state), dtype=torch.int32)
        drones = wp.from_torch(state.drone.double().contiguous(), dtype=wp.vec3d)
        attitudes = wp.from_torch(state.body.attitude.float().contiguous(), dtype=wp.vec4)
        inputs = [self.world(state, *steps), drones, attitudes]
        wp.launch(begin, len(state), inputs=inputs, device="cpu")
        return state

    def step(self, state: ObjectState, body: BodyState) -> tuple[ObjectState, Tensor]:
        """See `advance`, without a commanded speed."""
        return self.advance(state, body, torch.zeros(len(state), 4))

    def advance(
        self, state: ObjectState, body: BodyState, speeds: Tensor
    ) -> tuple[ObjectState, Tensor]:
        """Apply the rules: contacts, then the terms of reward, ends and success."""
        written = ("present", "touched", "goal", "sides", "action", "paid")
        copies = {name: getattr(state, name).clone() for name in written}
        new = dataclasses.replace(state, body=body, **copies)
        steps, ends = state.steps.int(), state.end_reason.int()
        rewards = torch.empty(len(state), dtype=torch.float64)
        before, now = state.drone, body.position
        velocity = body.velocity if self._has_time(body) else (now - before) / _SECONDS
        inputs = [
            self.world(new, steps, ends),
            _warp(before.double(), wp.vec3d),
            _warp(now.double(), wp.vec3d),
            _warp(velocity.float(), wp.vec3),
            _warp(body.attitude.float(), wp.vec4),
            _warp(body.is_lost),
            _warp(speeds.float(), wp.vec4),
            _warp(rewards),
        ]
        wp.launch(self.rules.step_all, len(state), inputs=inputs, device="cpu")
        new.steps, new.end_reason = steps.long(), ends.long()
        if not bool(rewards.isfinite().all()):
            self._name_unusable(new.paid)
        return new, rewards

    def _name_unusable(self, paid: Tensor) -> NoReturn:
        """Raise an `InputError` that names the reward terms whose values are not finite."""
        is_unusable = ~paid.isfinite().all(0)
        named = ", ".join(t.name for t, bad in zip(self._rewards, is_unusable, strict=True) if bad)
        raise InputError(
            f"task={self.name}: the reward terms {named} have values that are not finite; correct "
            "their functions, such as a division by 0 or a logarithm of it"
        )

    @staticmethod
    def _has_time(body: BodyState) -> bool:
        """Return whether dynamics give velocities; moves at once do not."""
        return isinstance(body, FlightState) or bool(body.velocity.any())

    def world(self, state: ObjectState, steps: Tensor, end_reasons: Tensor) -> Any:
        """Return the task's constants with arrays that share the memory of states; int32, (N,)."""
        world: Any = World()
        objects: Any = Objects()
        objects.shapes, objects.roles, objects.sizes = self._constants
        objects.places = _warp(state.places, wp.vec3d)
        objects.present, objects.touched = _warp(state.present), _warp(state.touched)
        world.objects = objects
        s = self.settings
        world.low, world.high = wp.vec3d(*s.low), wp.vec3d(*s.high)
        world.radius, world.seconds = 0.5 * s.drone_size, _SECONDS
        world.step_limit = s.step_limit
        world.weights, world.parameters = self._numbers
        world.goal, world.sides = _warp(state.goal), _warp(state.sides)
        world.actions, world.paid = _warp(state.action, wp.vec4), _warp(state.paid)
        world.steps, world.end_reasons = _warp(steps), _warp(end_reasons)
        return world

    @functools.cached_property
    def _constants(self) -> tuple[Any, Any, Any]:
        """Shapes, roles and half sizes of the objects."""
        start_warp("cpu")
        shapes = torch.tensor([SHAPES.index(of.shape) for of in self.each], dtype=torch.int32)
        sizes = torch.tensor([of.half_size for of in self.each], dtype=torch.float64)
        return _warp(shapes), _warp(self.roles.int()), _warp(sizes, wp.vec3d)

    @functools.cached_property
    def _numbers(self) -> tuple[Any, Any]:
        """Weights of the rewards, and the parameters of rewards, ends and success, in order."""
        start_warp("cpu")
        s = self.settings
        given = {**s.reward}
        weights = torch.tensor([of.weight for of in given.values()], dtype=torch.float64)
        terms = (*self._rewards, *self._ends, self._success)
        settings = (*s.reward.values(), *s.end.values(), *s.success.values())
        numbers = [
            getattr(of, name)
            for term, of in zip(terms, settings, strict=True)
            for name in term.parameters
        ]
        return _warp(weights), _warp(torch.tensor(numbers, dtype=torch.float32))

    def fused_rules(self, dynamics: Dynamics, num_envs: int) -> FusedTerms | None:
        """See `Task.fused_rules`."""
        is_solid = bool((self.roles == OBSTACLE).any())
        if not FusedTerms.supports(dynamics) or (is_solid and isinstance(dynamics, Quadrotor)):
            return None
        sampled = self.sample(np.random.RandomState(0)).expand(num_envs, -1)
        place = torch.tensor(self.origin, dtype=torch.float64).repeat(num_envs, 1)
        return FusedTerms(self, dynamics, self.start(sampled, dynamics.start(place)))

    def places(self, state: ObjectState) -> Tensor:
        """Return the objects' centres, those of absent ones under the floor."""
        hidden = (~state.present).double() * HIDDEN_DEPTH
        return state.places - torch.nn.functional.pad(hidden[..., None], (2, 0))

    def info(self, state: ObjectState) -> dict[str, Tensor]:
        """See `entries`."""
        goals = self.goals
        ahead = state.goal.long()
        return {
            "reached": state.touched[:, goals],
            "sides": state.sides[:, goals].long(),
            "places": state.places.float(),
            "present": state.present,
            "touched": state.touched,
            "goal": torch.where(ahead == NOTHING, len(self.each), ahead)[:, None],
            "paid": state.paid.float(),
            "end_reason": state.end_reason[:, None],
        }

    # Goals

    def score(self, info: Mapping[str, Tensor]) -> Goals:
        """Return the goals; their strata are the sides on which they came up."""
        return Goals(info["reached"], info["sides"], info["places"].flatten(1).double())

    # Explanations

    def remember(self, info: Mapping[str, Tensor]) -> dict[str, Tensor]:
        """Return the values of `remembered`."""
        kept = {name: info[name] for name in ("places", "present", "touched")}
        return {**kept, "next_target": info["goal"][:, 0]}

    def tally(self, info: Mapping[str, Tensor]) -> tuple[Tensor, Tensor]:
        """Return the number of goals reached; none is missed for good before the end."""
        reached = info["reached"].sum(-1)
        return reached, torch.zeros_like(reached)

    def recall(self, kept: Mapping[str, Tensor], body: BodyState) -> ObjectState:
        """Return states again; sides, actions and payments are not kept."""
        places = kept["places"].double()
        state = self._state_with(body, places, kept["present"].clone())
        state.touched, state.steps = kept["touched"].clone(), kept["step"].clone()
        return state

    def _state_with(self, body: BodyState, places: Tensor, present: Tensor) -> ObjectState:
        """Return states at the start of episodes with such objects; the drones keep their pose."""
        start = torch.cat([body.position, torch.zeros_like(body.position[:, :1])], -1)
        state = self.start(torch.cat([start, places.flatten(1)], -1), body)
        state.body, state.present = body, present
        return self._with_goal(state)

    def next_target(self, state: ObjectState) -> Tensor:
        """Return the goal ahead."""
        ahead = state.goal.long()
        return torch.where(ahead == NOTHING, len(self.each), ahead)

    def is_reached(self, state: ObjectState, target: Tensor) -> Tensor:
        """Return whether the drone has touched it."""
        return state.touched[torch.arange(len(state)), target.clamp(max=len(self.each) - 1)]

    def needed(self, offset: Tensor) -> Tensor:
        """Return a move to the side where flying straight on would miss the goal."""
        moves = torch.tensor([Move.LEFT, Move.FORWARD, Move.RIGHT])
        return moves[self.stratum_at(offset)]

    def stratum_at(self, offset: Tensor) -> Tensor:
        """Return its side."""
        return side_of(offset[..., 1], self._reach)

    @property
    def _reach(self) -> float:
        """Sideways distance up to which flying straight on touches the largest goal, metres."""
        goals = [of for of in self.each if of.role == "goal"]
        return max(of.half_size[1] for of in goals) + 0.5 * self.drone_size

    def grid(self, num_forward: int, num_lateral: int) -> Grid:
        """Return where goals can stand, seen from a start."""
        s = self.settings
        goals = [of for of in self.each if of.role == "goal"]
        heights = sorted({z - self.origin[2] for of in goals for z in of.range_of("z")})
        near = self._reach + 0.5 * s.step_length
        far = max(of.range_of("x")[1] for of in goals) - s.start.range_of("x")[0]
        starts = s.start.range_of("y")
        wide = max(abs(y - o) for of in goals for y in of.range_of("y") for o in starts)
        wide = max(wide, 2 * self._reach)
        forward = torch.linspace(near, max(far, near + s.step_length), num_forward).double()
        lateral = torch.linspace(wide, -wide, num_lateral).double()
        return Grid(torch.tensor(heights, dtype=torch.float64), forward, lateral)

    def one_target(self, body: BodyState, offset: Tensor) -> ObjectState:
        """Return states with the first goal alone."""
        number, first = len(body), int(self.goals[0])
        places = body.position[:, None].repeat(1, len(self.each), 1).double()
        places[:, first] += offset.to(places)
        present = torch.zeros(number, len(self.each), dtype=torch.bool)
        present[:, first] = True
        return self._state_with(body, places, present)

    def without_targets(self, state: ObjectState) -> ObjectState:
        """Remove all goals."""
        return self._changed(state, present=state.present & (self.roles != GOAL))

    def without_next(self, state: ObjectState) -> ObjectState:
        """Remove the goal ahead."""
        return self._changed(state, present=state.present & ~self._is_next(state))

    def next_moved(self, state: ObjectState, metres: Tensor | float) -> ObjectState:
        """Move the goal ahead to the left."""
        places = state.places.clone()
        metres = torch.as_tensor(metres, dtype=places.dtype).expand(len(places))
        places[..., 1] += metres[:, None] * self._is_next(state)
        return self._changed(state, places=places)

    def elsewhere(
        self, state: ObjectState, camera: CameraSettings, generator: torch.Generator
    ) -> ObjectState:
        """Put all goals at random positions in view, as far ahead as goals ever are."""
        forward, lateral = self.grid(2, 2)[1:]
        draw = torch.rand(*state.places.shape[:2], 2, generator=generator, dtype=torch.float64)
        away = place_in_view(draw, camera, float(forward[0]), float(forward[-1]), float(lateral[0]))
        places = state.places.clone()
        at = state.drone[:, None, :2] + away
        places[..., :2] = torch.where((self.roles == GOAL)[:, None], at, places[..., :2])
        present = state.present | (self.roles == GOAL)
        return self._changed(state, places=places, present=present)

    def _changed(self, state: ObjectState, **changes: Tensor) -> ObjectState:
        goal = state.goal.clone()
        return self._with_goal(dataclasses.replace(state, goal=goal, **changes))


def _warp(tensor: Tensor, kind: Any = None) -> Any:
    """Return a tensor as Warp's array, which shares its memory if it is contiguous."""
    return wp.from_torch(tensor.contiguous(), dtype=kind)


def define_task(name: str, **settings: Any) -> type[TermTaskSettings]:
    """Register a task of terms, which settings, commands and files then know by its name.

    Args:
        name: What commands call it: `task=NAME`.
        settings: Values of `TermTaskSettings`, which become the defaults of the new task.

    Returns:
        The class of the task's settings.

    Raises:
        InputError: A value is invalid, or there is another task of this name.
    """
    checked = TermTaskSettings.read(settings, name)
    hints = {field: TermTaskSettings.model_fields[field].rebuild_annotation() for field in settings}
    members = {"__annotations__": hints, "__module__": __name__, "name": name}
    values = {field: getattr(checked, field) for field in settings}
    kind: Any = type(f"{name}_settings", (TermTaskSettings,), {**members, **values})
    register_task(kind, TermTask)
    return kind
