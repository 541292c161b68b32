"""The task that is made of terms: objects, starts, rewards, ends and success."""

import enum
import math
import sys
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import torch
from torch import Tensor

from drone_rl.config.term_task import ObjectSettings, TermTaskSettings
from drone_rl.config.terms import ENDS, EVENTS, SUCCESSES
from drone_rl.sim.actions import Entry
from drone_rl.sim.dynamics import BodyState, Dynamics
from drone_rl.sim.scenes import SceneFile, load_scene
from drone_rl.sim.scenes.bodies import take_bodies
from drone_rl.sim.scenes.solids import solids_of
from drone_rl.sim.tasks.applied_rules import AppliedRules, reward_terms
from drone_rl.sim.tasks.common import Side
from drone_rl.sim.tasks.geometry_kernel import GOAL
from drone_rl.sim.tasks.objects import ObjectState, ObjectTask
from drone_rl.sim.tasks.path_oracle import PathOracle
from drone_rl.sim.tasks.rules_kernel import RUNNING, SUCCESS, make_rules
from drone_rl.sim.tasks.scene_edits import Range, SceneEdits
from drone_rl.sim.tasks.step_kernel import choose_nearest, choose_on_path
from drone_rl.sim.tasks.strata import PHRASES, START_AXES, Strata, drawn
from drone_rl.sim.tasks.task import Goals, register_task
from drone_rl.sim.vocabulary import TaskVocabulary
from drone_rl.utils.errors import InputError

_MOST_TRIES, _TRIES = 1000, 20
"""Most samples of all objects until none is too near to another one; samples of each object."""
_DETOURS = 2.0
"""Least quotient of the metres that an episode's actions can go and those of the longest path."""
_EXAMPLES = 300
"""Episodes that show where starts and goals of a scene are."""
_SLACK = 0.01
"""Metres by which objects in a scene may reach into its solids, such as into a floor."""
_AROUND = torch.cartesian_prod(*[torch.linspace(-1.0, 1.0, 7, dtype=torch.float64)] * 3)
_AROUND = _AROUND[_AROUND.abs().amax(1) == 1.0]
"""Points of the surface of a box, half edges from its middle. Shape: (218, 3)."""
_LAST_ENDS = ("STEP_LIMIT", "LOST_CONTROL")


class Curriculum:
    """The ranges in which episodes begin, from the narrowest ones to those of the settings.

    The level rises by `STEP` whenever a running mean of success reaches `SUCCESS`.
    """

    SUCCESS, STEP, DECAY = 0.8, 0.1, 0.9

    def __init__(self, settings: TermTaskSettings) -> None:
        """Begin at the end, where everything but a training stays."""
        self._settings = settings
        self.load((1.0, 0.0))

    def state(self) -> tuple[float, float]:
        """Return the level, 0 to 1, and the running success at it."""
        return self.level, self._success

    def load(self, state: Sequence[float]) -> None:
        """Return to a `state`; that of a new training is (0, 0)."""
        self.level, self._success = state
        self.ranges = self._settings.at_level(self.level)
        """Settings with the present ranges."""

    def note(self, success: float) -> bool:
        """Count the success rate of a batch; return whether the ranges are wider now."""
        mean = self.DECAY * self._success + (1 - self.DECAY) * success
        is_wider = mean >= self.SUCCESS and self.level < 1.0
        if is_wider:
            self.load((min(1.0, self.level + self.STEP), 0.0))
        else:
            self._success = mean
        return is_wider


def _routes(s: TermTaskSettings, scenes: Sequence[SceneFile]) -> Any:
    """Return `Routes`, or None without sites."""
    if not s.has_sites:
        return None
    if not scenes:
        raise InputError("task.scene=null has no sites of starts and goals; give a scene file")
    if not any(of.site for of in s.objects.values() if of.role == "goal"):
        raise InputError(
            f"task.start.site={s.start.site}, but no goal has a site; give one, too, such as "
            "task.objects.NAME.site=goal"
        )
    from drone_rl.sim.tasks.routes import find_routes  # scipy's graphs are slow to import

    return find_routes(s, scenes)


def _named(settings: TermTaskSettings, kinds: Mapping[str, Any]) -> dict[str, Any]:
    """Return a value of each object of a task by name, from those of some kinds."""
    return {
        f"{name}_{i}" if settings.objects[name].count > 1 else name: value
        for name, value in kinds.items()
        for i in range(settings.objects[name].count)
    }


def _with_bodies(
    s: TermTaskSettings, scenes: tuple[SceneFile, ...]
) -> tuple[TermTaskSettings, tuple[SceneFile, ...], dict[str, SceneFile]]:
    """Return settings with places and sizes of a scene's bodies, the scenes without, and these.

    Raises:
        InputError: There is not one scene with these bodies, or one of them can't be touched.
    """
    named = {name: of for name, of in s.objects.items() if of.body}
    if not named:
        return s, scenes, {}
    for name, of in named.items():
        setting = f"task.objects.{name}.body={of.body}"
        if len(scenes) != 1:
            raise InputError(f"{setting} needs one scene; give one file, task.scene=FILE")
        if of.replace(shape="box", size=(1.0, 1.0, 1.0)) != of:
            raise InputError(f"{setting} has its own shape and size; leave out shape and size")
    rest, bodies = take_bodies(scenes[0], tuple((of.body, of.heading) for of in named.values()))
    objects = dict(s.objects)
    for (name, of), body in zip(named.items(), bodies, strict=True):
        if of.role != "decoration" and not any(body.scene.solid):
            raise InputError(
                f"task.objects.{name}.body={of.body}: nothing in it can be touched; give geoms a "
                "contype or conaffinity other than 0, or the object role=decoration"
            )
        place = zip("xyz", body.center, strict=True)
        at = {axis: value for axis, value in place if getattr(of, axis) is None}
        objects[name] = of.replace(heading=0.0, size=tuple(max(0.01, of) for of in body.size), **at)
    scenes_of = {name: body.scene for name, body in zip(named, bodies, strict=True)}
    return s.replace(objects=objects), (rest,), scenes_of


def _has_room(
    s: TermTaskSettings, of: ObjectSettings, place: Any, placed: list[Any], start: Any
) -> bool:
    """Return whether boxes around an object, the ones before it and the drone keep apart."""
    reach, drone = np.array(of.reach), np.array(start)
    if of.role != "decoration":
        gap = np.abs(place - drone) - reach - 0.5 * s.drone_size
        if np.linalg.norm(gap.clip(0)) <= s.start.apart:
            return False
    gaps = (np.abs(place - other) - reach - np.array(o.reach) for o, other in placed)
    return of.apart == 0 or all(np.linalg.norm(gap.clip(0)) >= of.apart for gap in gaps)


class _AtSites(NamedTuple):
    """What is at sites in an episode."""

    start: list[float] | None = None
    """x, y, z, metres, and heading, degrees; None for that of the settings."""
    places: Mapping[tuple[str, int], Any] = {}
    """Centres by name and number of the object."""
    numbers: Sequence[int] = ()
    """Of the scene, the start, and the route to each object, -1 for none."""


class TermTask(ObjectTask):
    """A task of terms: every rule is that of its settings; see `define_task`."""

    success_end = SUCCESS
    largest_reward = None
    observed = ("reached", "end_reason")
    scored = ("reached", "sides", "sampled", "end_reason")

    def __init__(self, settings: TermTaskSettings) -> None:
        """Take the settings of a task of terms."""
        s = settings
        self.scenes = tuple(load_scene(path, s.scene_up, s.scene_scale) for path in s.scene or ())
        s, self.surroundings, bodies = _with_bodies(s, self.scenes)
        self._whole: Any = s
        self.bodies = _named(s, bodies)
        self.name, objects = s.name, _named(s, s.objects)
        ends = tuple(ENDS.by_name[name] for name in s.end)
        (success,) = (SUCCESSES.by_name[name] for name in s.success)
        kinds = [*s.objects.values()]
        events = tuple((i, EVENTS.by_name[name]) for i, of in enumerate(kinds) for name in of.event)
        given = (
            *s.end.values(),
            *s.success.values(),
            *(e for of in kinds for e in of.event.values()),
        )
        named = zip((*ends, success, *(term for _, term in events)), given, strict=True)
        self.routes = _routes(s, self.surroundings)
        """Starts, goals and paths at sites of the scenes; None without sites."""
        low, high = s.low, s.high
        if self.routes is not None:
            low, high = self.routes.low - s.margin, self.routes.high + s.margin
        choose = choose_nearest if self.routes is None else choose_on_path
        rules = AppliedRules(
            make_rules(reward_terms(s.reward), ends, success, events, choose=choose),
            s,
            [*objects.values()],
            rewards=s.reward,
            parameters=[getattr(of, name) for term, of in named for name in term.parameters],
            low=low,
            high=high,
            routes=() if self.routes is None else self.routes.routes,
            events=[
                i if of.event else -1
                for i, of in enumerate(kinds)
                for _ in range(of.count)
                if events
            ],
        )
        super().__init__(settings, objects, rules)
        self.num_sampled = 4 + (4 if events else 3) * len(objects) + bool(self.scenes)
        if self.routes is not None:
            self.num_sampled += 1 + len(objects)
        own = [term.name.upper() for term in ends]
        reasons: Any = enum.IntEnum("End", ["RUNNING", "SUCCESS", *own, *_LAST_ENDS], start=0)
        self.ends = reasons
        self.truncation = self.expected_end = reasons["STEP_LIMIT"]
        starts, goals = self._drawn()
        self.origin = tuple(starts[0, :3].tolist())
        self._strata = Strata(starts, goals)
        self.strata = tuple(self._strata.phrases)
        self.vocabulary = TaskVocabulary(
            tested=f"scenes of the task {s.name}",
            sides=self._strata.phrases,
            places=PHRASES,
            labels={"side": "bearing and distance at the start"},
            **({} if success.name == "all_goals" else _own_success(success.name)),
        )
        self.edits = self._edits(starts, goals)
        self.curriculum = Curriculum(s) if s.curriculum else None
        if self.routes is not None:
            self._follow(self.routes)

    def _follow(self, routes: Any) -> None:
        """Let an oracle follow the routes, and refuse actions that can't."""
        self.oracle = PathOracle(
            routes.routes,
            routes.clearances,
            self.routes_of,
            radius=routes.radius,
            step=self.settings.step_length,
        )
        if not routes.is_level:
            height = routes.routes[0].center[2]
            self.needed_actions = {
                "up": "starts and goals are at different heights, where drones that keep theirs do "
                "not arrive; give actions=moves_full, actions.climb_speed=1 (of actions=velocity), "
                f"or a height for all, such as task.start.z={height:.4g}"
            }

    def check_dynamics(self, dynamics: Dynamics) -> None:
        """See `Task.check_dynamics`; there must be steps for the way to a goal, and for detours."""
        super().check_dynamics(dynamics)
        metres = _DETOURS * (0.0 if self.routes is None else self.routes.most_metres)
        stride, limit = getattr(dynamics, "stride", math.inf), self.settings.step_limit
        if metres > limit * stride:
            raise InputError(
                f"task.step_limit={limit}, but to a goal of {self.name} it is up to "
                f"{metres / _DETOURS / stride:.0f} actions of {stride:.2g} m, without turns and "
                f"detours; give task.step_limit={math.ceil(metres / stride)}, or actions of "
                f"{metres / limit:.2g} m or more (task.step_length of moves, actions.forward_speed "
                "of velocities)"
            )

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
            "sampled": Entry((self.num_sampled,), torch.float32),
            "present": Entry((objects,), torch.bool),
            "touched": Entry((objects,), torch.bool),
            "goal": Entry((1,), torch.int64, 0, objects),
            "paid": Entry((len(self.reward_terms),), torch.float32),
            "end_reason": Entry((1,), torch.int64, 0, len(self.ends) - 1),
        }

    def sample(self, random_state: np.random.RandomState) -> Tensor:
        """Sample x, y, z (m) and heading (rad) of the start, then the centres. Shape: (K,).

        The scene's number follows if there are scene files; then, if they have sites of starts and
        goals, the number of the start and of the route to each object, see `Routes`. With events,
        the last P numbers are the objects' phases, see `Mover`.

        Raises:
            InputError: A region has no room left for an object.
        """
        s = self._whole if self.curriculum is None else self.curriculum.ranges
        crowded = ""
        for _ in range(_MOST_TRIES):
            at_sites = self._at_sites(s, random_state)
            start = at_sites.start
            if start is None:
                start = [random_state.uniform(*s.start.range_of(axis)) for axis in START_AXES]
            scene = [*at_sites.numbers[:1]]
            if self.scenes and not scene:
                scene = [random_state.randint(len(self.scenes))]
            placed, crowded = self._placed(s, start[:3], random_state, at_sites.places, *scene)
            if not crowded:
                phases = random_state.uniform(
                    size=len(self.each) if self.rules.compiled.events else 0
                )
                begun = [*start[:3], math.radians(start[3])]
                numbers = np.concatenate([begun, *placed, scene, at_sites.numbers[1:], phases])
                return torch.from_numpy(numbers)
        raise InputError(
            f"task.objects: found no room for {crowded} in {_MOST_TRIES} tries that keeps "
            f"{s.objects[crowded].apart:g} m from other objects and {s.start.apart:g} m from the "
            f"start{', outside of what is solid' if self.scenes else ''}; give a larger range of x "
            "or y, a smaller apart, or fewer objects"
        )

    def _at_sites(self, s: TermTaskSettings, random_state: np.random.RandomState) -> "_AtSites":
        """Sample what is at sites of a scene."""
        if self.routes is None:
            return _AtSites()
        scene = random_state.randint(len(self.scenes))
        places, routes, goal = {}, [], None
        for name, of in s.objects.items():
            for i in range(of.count):
                if not of.site:
                    routes.append(-1)
                    continue
                places[name, i], found = self.routes.place(scene, name, random_state)
                routes.append(-1 if found is None or of.event else found.route)
                goal = goal or found
        start, number = None, 0
        if s.start.site and goal is not None:
            place, heading, number = self.routes.start(goal, random_state)
            start = [*place, heading]
        return _AtSites(start, places, [scene, number, *routes])

    def _placed(
        self,
        s: TermTaskSettings,
        start: Any,
        random_state: np.random.RandomState,
        given: Mapping[tuple[str, int], Any],
        scene: int = 0,
    ) -> tuple[list[Any], str]:
        """Return centres of the objects, and the name of those that found no room, if any.

        Those that are not `given` have none inside of a scene's solids, if they have a range.
        """
        placed: list[Any] = []
        for name, of in s.objects.items():
            for i in range(of.count):
                at_site, ranges = given.get((name, i)), [of.range_of(axis) for axis in "xyz"]
                is_drawn = at_site is None and any(low < high for low, high in ranges)
                is_drawn &= bool(self.scenes)
                for _ in range(_TRIES):
                    place = at_site
                    if place is None:
                        place = np.array([random_state.uniform(low, high) for low, high in ranges])
                    if _has_room(s, of, place, placed, start) and not (
                        is_drawn and self._are_solid(scene, of, place[None]).item()
                    ):
                        placed.append((of, place))
                        break
                else:
                    if is_drawn:
                        self._require_room(scene, name, of)
                    return [], name
        return [place for _, place in placed], ""

    def _are_solid(self, scene: int, of: ObjectSettings, places: Any) -> Tensor:
        """Return whether something solid is in the box around an object; a floor touches it.

        `places` are its centres, (n, 3). Shape: (n,).
        """
        solids = solids_of((self.surroundings[scene],), "cpu")
        middles = torch.from_numpy(places)
        rays = (torch.tensor(of.reach, dtype=torch.float64) - _SLACK) * _AROUND
        begins = middles[:, None].expand(-1, len(rays), -1)
        ways = solids.sweep(begins.flatten(0, 1), (begins + rays).flatten(0, 1)).fraction
        return (ways <= 1.0).unflatten(0, (-1, len(rays))).any(1) | (
            solids.distances(middles) <= 0.0
        )

    def _require_room(self, scene: int, name: str, of: ObjectSettings) -> None:
        """Raise an `InputError` if nothing is free in the range of an object, by a sample."""
        reach = [of.range_of(axis) for axis in "xyz"]
        low, high = zip(*reach, strict=True)
        places = np.random.RandomState(0).uniform(low, high, (_MOST_TRIES, 3))
        if self._are_solid(scene, of, places).all():
            named = zip("xyz", reach, strict=True)
            ranges = ", ".join(f"{x} from {a:g} to {b:g}" for x, (a, b) in named)
            raise InputError(
                f"task.objects.{name}: something is solid wherever it is placed in {ranges} m; "
                "give ranges in which the scene has room for it"
            )

    def start(self, sampled: Tensor, body: BodyState) -> ObjectState:
        """Return initial states; see `sample`."""
        half = 0.5 * sampled[:, 3]
        zero = torch.zeros_like(half)
        attitude = torch.stack([half.cos(), zero, zero, half.sin()], -1)
        places = self._sampled_places(sampled).clone()
        return self.begun(body.moved(sampled[:, :3].clone(), attitude), places, sampled.clone())

    def _sampled_places(self, sampled: Tensor) -> Tensor:
        """Return the sampled centres. Shape: (N, K) to (N, P, 3)."""
        return sampled[:, 4 : 4 + 3 * len(self.each)].unflatten(1, (-1, 3))

    def scene_of(self, state: ObjectState) -> Tensor:
        """See `ObjectTask.scene_of`."""
        return state.sampled[:, 4 + 3 * len(self.each)].long()

    def starts_of(self, state: ObjectState) -> Tensor:
        """Return the number of each episode's start, of `Routes.start_names`. Shape: (N,)."""
        return state.sampled[:, 5 + 3 * len(self.each)].long()

    def routes_of(self, state: ObjectState) -> Tensor:
        """Return the number of the route to each object, -1 for none. Shape: (N, P), int64."""
        first = 6 + 3 * len(self.each)
        return state.sampled[:, first : first + len(self.each)].long()

    def info(self, state: ObjectState) -> dict[str, Tensor]:
        """See `entries`."""
        goals = self.goals.to(state.places.device)
        return {
            "reached": state.reached[:, goals],
            "sides": state.sides[:, goals].long(),
            "places": state.places.float(),
            "sampled": state.sampled.float(),
            "present": state.present,
            "touched": state.touched,
            "goal": self.edits.next_target(state)[:, None],
            "paid": state.paid.float(),
            "end_reason": state.end_reason[:, None],
        }

    def score(self, info: Mapping[str, Tensor]) -> Goals:
        """Return the goals; see `Strata`.

        If success has another meaning, its episode's end counts for all of them.
        """
        reached, sampled, end = (info[name] for name in ("reached", "sampled", "end_reason"))
        if self.vocabulary.succeed:
            reached = torch.where(end == RUNNING, reached, end == SUCCESS)
        places = self._sampled_places(sampled)[:, self.goals.to(sampled.device)]
        stratum = self._strata.of(sampled[:, :4], places).where(info["sides"] >= 0, -1)
        return Goals(reached, stratum, sampled.double())

    def _drawn(self) -> tuple[Tensor, Tensor]:
        """Return examples of starts and goals, as `seen_from_start` takes them."""
        if self.routes is None:
            return drawn(self._whole)
        source = np.random.RandomState(0)
        sampled = torch.stack([self.sample(source) for _ in range(_EXAMPLES)])
        return sampled[:, :4], self._sampled_places(sampled)[:, self.goals]

    def _edits(self, starts: Tensor, places: Tensor) -> SceneEdits:
        """Return changes of its scenes; random goals are as far ahead as goals ever are."""
        s = self.settings
        goals = [of for of in self.each if of.role == "goal"]
        reach = max(of.reach[1] for of in goals) + 0.5 * self.drone_size
        near = reach + 0.5 * s.step_length
        if self.routes is not None:
            far = float((places - starts[:, None, :3]).norm(dim=-1).quantile(0.5))
            far = Range(near, max(far, near + s.step_length), max(far, 2 * reach))
            return SceneEdits(self, reach, far, far, course=None)
        far, wide = (
            max(
                abs(a - b)
                for of in goals
                for a in of.range_of(axis)
                for b in s.start.range_of(axis)
            )
            for axis in "xy"
        )
        first, last = s.start.range_of("heading")
        if first != 0.0 or last != 0.0:
            far = wide = math.hypot(far, wide)
        ahead = Range(near, max(far, near + s.step_length), max(wide, 2 * reach))
        heights = sorted({z - self.origin[2] for of in goals for z in of.range_of("z")})
        course = math.radians(first) if first == last else None
        return SceneEdits(self, reach, ahead, ahead, tuple(heights), course=course)


def _own_success(name: str) -> dict[str, str]:
    """Return the words of a task in which success is more than to reach every goal, or less."""
    return {"reach": "succeed with", "reached": "with success", "succeed": f"succeed ({name})"}


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
    caller = sys._getframe(1).f_globals.get("__name__", __name__)  # as collections.namedtuple does
    members = {"__annotations__": hints, "__module__": caller, "name": name}
    values = {field: getattr(checked, field) for field in settings}
    kind: Any = type(f"{name}_settings", (TermTaskSettings,), {**members, **values})
    register_task(kind, TermTask)
    return kind
