"""The task that is made of terms: objects, starts, rewards, ends and success."""

import enum
import math
import sys
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import torch
from torch import Tensor

from drone_rl.config.term_task import ObjectSettings, TermTaskSettings
from drone_rl.config.terms import ENDS, SUCCESSES
from drone_rl.sim.actions import Entry
from drone_rl.sim.dynamics import BodyState
from drone_rl.sim.tasks.applied_rules import AppliedRules, reward_terms
from drone_rl.sim.tasks.common import Side
from drone_rl.sim.tasks.geometry_kernel import GOAL
from drone_rl.sim.tasks.objects import ObjectState, ObjectTask
from drone_rl.sim.tasks.rules_kernel import SUCCESS, make_rules
from drone_rl.sim.tasks.scene_edits import Range, SceneEdits
from drone_rl.sim.tasks.task import Goals, register_task
from drone_rl.sim.vocabulary import TaskVocabulary
from drone_rl.utils.errors import InputError

_MOST_TRIES, _TRIES = 1000, 20
"""Most samples of all objects until none is too near to another one; samples of each object."""
_START = ("x", "y", "z", "heading")
_SIDES = {"left": "on its left", "ahead": "ahead", "right": "on its right"}
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


def _named(settings: TermTaskSettings) -> dict[str, ObjectSettings]:
    """Return the objects of a task by name."""
    return {
        f"{name}_{i}" if of.count > 1 else name: of
        for name, of in settings.objects.items()
        for i in range(of.count)
    }


class TermTask(ObjectTask):
    """A task of terms: every rule is that of its settings; see `define_task`."""

    success_end = SUCCESS
    largest_reward = None
    observed = ("reached", "end_reason")
    scored = ("reached", "sides", "sampled", "end_reason")

    def __init__(self, settings: TermTaskSettings) -> None:
        """Take the settings of a task of terms."""
        s = settings
        self.name = s.name
        ends = tuple(ENDS.by_name[name] for name in s.end)
        (success,) = (SUCCESSES.by_name[name] for name in s.success)
        named = zip((*ends, success), (*s.end.values(), *s.success.values()), strict=True)
        objects = _named(s)
        rules = AppliedRules(
            make_rules(reward_terms(s.reward), ends, success),
            s,
            [*objects.values()],
            rewards=s.reward,
            parameters=[getattr(of, name) for term, of in named for name in term.parameters],
            low=s.low,
            high=s.high,
        )
        super().__init__(s, objects, rules)
        self.num_sampled = 4 + 3 * len(objects)
        x, y, z = (sum(s.start.range_of(axis)) / 2 for axis in "xyz")
        self.origin = (x, y, z)
        own = [term.name.upper() for term in ends]
        kinds: Any = enum.IntEnum("End", ["RUNNING", "SUCCESS", *own, *_LAST_ENDS], start=0)
        self.ends = kinds
        self.truncation = self.expected_end = kinds["STEP_LIMIT"]
        self.vocabulary = TaskVocabulary(
            tested=f"scenes of the task {s.name}",
            sides=_SIDES,
            places=_SIDES,
        )
        self.edits = self._edits()
        self.curriculum = Curriculum(s) if s.curriculum else None

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
        """Sample x, y, z (m) and heading (rad) of the start, then the centres. Shape: (4 + 3 P,).

        Raises:
            InputError: A region has no room left for an object.
        """
        s = self.settings if self.curriculum is None else self.curriculum.ranges
        crowded = ""
        for _ in range(_MOST_TRIES):
            *start, heading = (random_state.uniform(*s.start.range_of(axis)) for axis in _START)
            placed, crowded = self._placed(s, start, random_state)
            if not crowded:
                places = np.concatenate([[*start, math.radians(heading)], *placed])
                return torch.from_numpy(places)
        raise InputError(
            f"task.objects: found no room for {crowded} in {_MOST_TRIES} tries that keeps "
            f"{s.objects[crowded].apart:g} m from other objects and {s.start.apart:g} m from the "
            "start; give a larger range of x or y, a smaller apart, or fewer objects"
        )

    def _placed(
        self, s: TermTaskSettings, start: Any, random_state: np.random.RandomState
    ) -> tuple[list[Any], str]:
        """Return centres of the objects, and the name of those that found no room, if any."""
        placed: list[Any] = []
        for name, of in s.objects.items():
            for _ in range(of.count):
                for _ in range(_TRIES):
                    place = np.array([random_state.uniform(*of.range_of(axis)) for axis in "xyz"])
                    if self._has_room(of, place, placed, start):
                        placed.append((of, place))
                        break
                else:
                    return [], name
        return [place for _, place in placed], ""

    def _has_room(self, of: ObjectSettings, place: Any, placed: list[Any], start: Any) -> bool:
        """Return whether boxes around an object, the ones before it and the drone keep apart."""
        s = self.settings
        reach, drone = np.array(of.reach), np.array(start)
        if of.role != "decoration":
            gap = np.abs(place - drone) - reach - 0.5 * s.drone_size
            if np.linalg.norm(gap.clip(0)) <= s.start.apart:
                return False
        gaps = (np.abs(place - other) - reach - np.array(o.reach) for o, other in placed)
        return of.apart == 0 or all(np.linalg.norm(gap.clip(0)) >= of.apart for gap in gaps)

    def start(self, sampled: Tensor, body: BodyState) -> ObjectState:
        """Return initial states; see `sample`."""
        half = 0.5 * sampled[:, 3]
        zero = torch.zeros_like(half)
        attitude = torch.stack([half.cos(), zero, zero, half.sin()], -1)
        places = sampled[:, 4:].reshape(len(sampled), len(self.each), 3).clone()
        return self.begun(body.moved(sampled[:, :3].clone(), attitude), places, sampled.clone())

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
        """Return the goals; their strata are the sides on which they came up.

        A success counts as all of them: its own meaning may need only some.
        """
        reached = info["reached"] | (info["end_reason"] == SUCCESS)
        return Goals(reached, info["sides"], info["sampled"].double())

    def _edits(self) -> SceneEdits:
        """Return changes of its scenes; random goals are as far ahead as goals ever are."""
        s = self.settings
        goals = [of for of in self.each if of.role == "goal"]
        reach = max(of.reach[1] for of in goals) + 0.5 * self.drone_size
        near = reach + 0.5 * s.step_length
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
