"""Tasks whose rules are about objects: their state, and what their rules share."""

import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import Any

import torch
from torch import Tensor

from drone_rl.config.term_task import ROLES, ObjectSettings
from drone_rl.sim.dynamics import BodyState, ComputerVision, Dynamics, FlightState, Obstacles
from drone_rl.sim.entities import SceneEntity, VisualEntity
from drone_rl.sim.rendering.scene import SemanticClass
from drone_rl.sim.scenes import SceneFile
from drone_rl.sim.scenes.solids import PlacedSolids, solids_of
from drone_rl.sim.scenes.solids_kernel import TOUCHING
from drone_rl.sim.tasks.applied_rules import AppliedRules
from drone_rl.sim.tasks.common import FAR_BELOW, HIDDEN_DEPTH, SIDES
from drone_rl.sim.tasks.geometry_kernel import NOTHING, OBSTACLE
from drone_rl.sim.tasks.task import State, Task

_CLASSES = (SemanticClass.TARGET, SemanticClass.OBSTACLE, SemanticClass.DECORATION)
_KINDS = {"ball": "sphere", "cylinder": "cylinder", "box": "box"}
_PLAIN = torch.contiguous_format


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
    sampled: Tensor  # (N, K) float64
    """What a task of terms sampled for the episode; K is 0 for other tasks."""


def class_of(settings: ObjectSettings) -> SemanticClass:
    """Return the semantic class of an object's role."""
    return _CLASSES[ROLES.index(settings.role)]


class ObjectEntity(VisualEntity):
    """An object; its frame is at its centre. Metres."""

    def _build(self, settings: ObjectSettings, name: str) -> None:
        self.semantic_class = class_of(settings)
        half = settings.half_size
        size = {"ball": half[:1], "cylinder": (half[0], half[2]), "box": half}[settings.shape]
        self._add_geom(_KINDS[settings.shape], size, settings.color, name)
        half_angle = 0.5 * math.radians(settings.heading)
        self.geom.quat = math.cos(half_angle), 0.0, 0.0, math.sin(half_angle)


class ObjectTask(Task[ObjectState]):
    """A task whose rules are Warp functions of objects; a subclass gives them to `__init__`."""

    strata = SIDES
    num_sampled: int = 0
    """K of `ObjectState.sampled`."""
    scenes: tuple[SceneFile, ...] = ()
    """The S scenes, one of which each episode takes place in; none for an empty field."""
    bodies: Mapping[str, SceneFile] = {}
    """The objects that are bodies of the scene, by name; all of one scene."""
    surroundings: tuple[SceneFile, ...] = ()
    """The scenes without these bodies."""

    def __init__(
        self,
        settings: Any,
        objects: Mapping[str, ObjectSettings],
        rules: AppliedRules,
        *,
        num_goals: int | None = None,
    ) -> None:
        """Take the objects and rules of a task.

        Args:
            settings: Of the task, with `drone_size`, `step_length` and `step_limit`.
            objects: The P objects by name.
            rules: Their rules.
            num_goals: Number of goals; by default each object that is one.
        """
        self.settings, self.objects, self.rules = settings, objects, rules
        self.drone_size = settings.drone_size
        self.each = tuple(objects.values())
        """Settings of each of the P objects."""
        self.roles = torch.tensor([ROLES.index(of.role) for of in self.each], dtype=torch.int32)
        self.num_goals = len(self.each) if num_goals is None else num_goals
        numbers = [number for number, name in enumerate(objects) if name in self.bodies]
        self._bodies = torch.tensor(numbers, dtype=torch.int64)
        """Numbers of the objects that are bodies of the scene. Shape: (B,)."""
        self.reward_terms = tuple(term.name for term in rules.compiled.rewards)

    def __reduce__(self) -> Any:
        """Copy and pickle the settings, since rules are compiled; a subclass adds its arguments."""
        return type(self), (self.settings,), {"curriculum": self.curriculum}

    def make_dynamics(self) -> Dynamics:
        """Return moves of the task's length (Table 1 of Luo et al., 2018)."""
        return ComputerVision(self.settings.step_length)

    def make_props(self) -> list[ObjectEntity | SceneEntity]:
        """Return the objects, in order, then the scenes."""
        objects = [
            SceneEntity(self.bodies[name], name, class_of(of))
            if name in self.bodies
            else ObjectEntity(of, name=name)
            for name, of in self.objects.items()
        ]
        scenes = [SceneEntity(of, name=f"scene_{i}") for i, of in enumerate(self.surroundings)]
        return [*objects, *scenes]

    def begun(self, body: BodyState, places: Tensor, sampled: Tensor | None = None) -> ObjectState:
        """Return states at the start of episodes, with objects at places, (N, P, 3).

        Raises:
            InputError: A term can't be compiled.
        """
        self.rules.compiled.load()
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
            paid=torch.zeros(count, len(self.reward_terms), dtype=torch.float64, device=device),
            sampled=places.new_zeros(count, self.num_sampled) if sampled is None else sampled,
        )
        self.look_ahead(state)
        return state

    def look_ahead(self, state: ObjectState) -> None:
        """Choose what is ahead again, in place, such as after objects have moved."""
        state.ahead[:] = NOTHING
        self.rules.begin(state)

    def step(
        self,
        state: ObjectState,
        body: BodyState,
        action: Tensor | None = None,
        dynamics: Dynamics | None = None,
    ) -> tuple[ObjectState, Tensor]:
        """Apply the rules: contacts, what is ahead, rewards, ends and success.

        In a scene, what the dynamics have touched counts as well as what is on the straight path.

        `action`, (N, *), is what `dynamics` took, for terms that read it; None for none.
        """
        copies = {
            name: getattr(state, name).clone(memory_format=_PLAIN) for name in self.rules.written
        }
        counts = {"steps": state.steps.clone(), "end_reason": state.end_reason.clone()}
        new = dataclasses.replace(state, body=body, **counts, **copies)
        speeds = torch.zeros_like(state.action)
        if action is not None and dynamics is not None:
            speeds = dynamics.actions.speeds_of(action)
        moved = self.rules.move(new, state.drone, dynamics)
        around = None
        if self.scenes:
            around = self._around(state, new, dynamics)
        return new, self.rules.step(new, state.drone, speeds, dynamics, around, moved)

    def _around(
        self, state: ObjectState, new: ObjectState, dynamics: Dynamics | None
    ) -> tuple[Tensor, ...]:
        """Return `World.struck`, `gaps` and `hits` of a step between states."""
        body = new.body
        is_stopped = getattr(dynamics, "stops_at_solids", False)
        is_flown = isinstance(body, FlightState)  # not straight
        before = None if is_stopped and not is_flown else state.drone
        struck, gaps = self._solids(new, ()).touched(before, body.position)
        if isinstance(body, FlightState) and isinstance(state.body, FlightState):
            struck |= body.contact.time > state.body.contact.time
        if not self.bodies:
            return struck, gaps
        fractions, distances = self._meet(state, new)
        hits = torch.full_like(state.places[..., 0], torch.inf)
        hits[:, self._bodies] = fractions
        is_there = new.present & (self.roles == OBSTACLE).to(new.present.device)
        distances = distances.where(is_there[:, self._bodies], torch.inf)
        return struck, gaps.minimum(distances.amin(1)), hits

    def _meet(self, state: ObjectState, new: ObjectState) -> tuple[Tensor, Tensor]:
        """Return where straight ways of drones and bodies meet, and how far apart they end.

        Returns:
            Fraction of the step, infinite if they don't meet, and metres. Shapes: (N, B).
        """
        count = len(self._bodies)
        before, now = (
            (of.drone[:, None] - of.places[:, self._bodies]).flatten(0, 1) for of in (state, new)
        )
        solids = self._solids(new, ()).solids
        places = before.new_zeros(count, solids.count, 3)
        places[..., 2] = -FAR_BELOW
        places[torch.arange(count), torch.arange(count)] = 0.0
        rows = torch.arange(count, device=before.device).repeat(len(state))
        radius = 0.5 * self.drone_size
        distance = solids.nearest_at(now, places, rows).distance
        fraction = solids.sweep_at(before, now, radius, places, rows).fraction
        is_touching = distance <= radius + float(TOUCHING)
        fraction = fraction.where(~is_touching, fraction.clamp(max=1.0))
        return fraction.unflatten(0, (-1, count)), distance.unflatten(0, (-1, count))

    def touch(
        self, state: ObjectState, position: Tensor, before: Tensor | None = None
    ) -> Tensor | None:
        """Apply the rules of contact in place, without a step or reward; by default there are none.

        `position` is that of each drone, metres, and `before` where it comes from, if it touches
        what is on the straight path. Shapes: (num_envs, 3).

        Returns:
            Fraction of the path before each object was touched; inf without contact, (N, P).
            Without any contact it may be None.
        """

    def places(self, state: ObjectState) -> Tensor:
        """Return the objects' centres, then the scenes' origins; those of absent ones below."""
        hidden = (~state.present).double() * (FAR_BELOW if self.scenes else HIDDEN_DEPTH)
        objects = state.places - torch.nn.functional.pad(hidden[..., None], (2, 0))
        if not self.scenes:
            return objects
        scenes = objects.new_zeros(len(objects), len(self.scenes), 3)
        scenes[..., 2] = -FAR_BELOW
        scenes[torch.arange(len(objects)), self.scene_of(state)] = 0.0
        return torch.cat([objects, scenes], 1)

    def solids(self, state: ObjectState) -> PlacedSolids:
        """Return what is solid in the scene of each episode; not for an empty field."""
        obstacles = (self.roles[self._bodies] == OBSTACLE).nonzero()[:, 0]
        return self._solids(state, obstacles.tolist())

    def _solids(self, state: ObjectState, bodies: Sequence[int]) -> PlacedSolids:
        """Return what is solid with some of the bodies, by number; their groups come first."""
        every = self.places(state)
        places = every[:, [*self._bodies.tolist(), *range(len(self.each), every.shape[1])]]
        absent = [i for i in range(len(self._bodies)) if i not in bodies]
        places[:, absent, 2] = -FAR_BELOW
        solids = solids_of((*self.bodies.values(), *self.surroundings), str(places.device))
        return PlacedSolids(solids, places, 0.5 * self.drone_size)

    def scene_of(self, state: ObjectState) -> Tensor:
        """Return the number of each episode's scene, of `scenes`. Shape: (N,), int64."""
        return torch.zeros(len(state), dtype=torch.int64, device=state.places.device)

    def obstacles(self, state: ObjectState) -> Obstacles | None:
        """Return the scene, and solid objects if all are of one size and parallel to the axes."""
        solid = [
            i
            for i, (name, of) in enumerate(self.objects.items())
            if of.role == "obstacle" and name not in self.bodies
        ]
        is_turned = any(self.each[i].heading for i in solid)
        if is_turned or len({self.each[i].half_size for i in solid}) != 1:
            if not self.scenes:
                return None
            solid = []
        half = self.each[solid[0]].half_size if solid else (0.0, 0.0, 0.0)
        scene = self.solids(state) if self.scenes else None
        return Obstacles(self.places(state)[:, solid], half, scene)


def follows_rules(task: Task[Any]) -> bool:
    """Return whether the steps of a task are those of its `rules`, which no subclass overrides."""
    names = ("step", "places", "obstacles")
    return all(getattr(type(task), name) is getattr(ObjectTask, name, None) for name in names)
