"""What reports call the goals, targets and actions of a task."""

import dataclasses
import re
from collections.abc import Mapping
from typing import Any

from drone_rl.utils.errors import InputError
from drone_rl.utils.schema import Flag, Kind, Real, Record, Several, Text, Whole, as_mapping, shown

LONGEST = 200
"""Characters of a phrase."""
MOST = 64
"""Phrases of a kind."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class TaskVocabulary:
    """What reports call the goals and targets of a task, as files have them under "terms"."""

    goal: str = "goal"
    """What has to be reached, one by one: "cube"."""
    reach: str = "reach"
    """What is done to a goal: "collect"."""
    reached: str = "reached"
    """And has been done: "collected"."""
    target: str = "target"
    """What stands in the picture and calls for action: "cube"."""
    handle: str = "reach the target"
    """What is done about a single target: "collect the cube"."""
    handled: str = "reached"
    """And has been done: "collected"."""
    unhandled: str = "missed"
    """And has not been done: "missed"."""
    tested: str = ""
    """In what it is flown, for its card: "three cubes of 2.5 m"."""
    follows: bool = True
    """Whether a target is flown to, and so followed where it moves; else it is flown around."""
    sides: Mapping[str, str] = dataclasses.field(default_factory=dict)
    """Of goals, by stratum: "on its left"."""
    places: Mapping[str, str] = dataclasses.field(default_factory=dict)
    """Of places of a single target, by stratum: "on its left"."""
    classes: Mapping[str, str] = dataclasses.field(default_factory=dict)
    """Where it fails, by what classes of goals are made by: "at the {value} cube"."""
    labels: Mapping[str, str] = dataclasses.field(default_factory=dict)
    """What tables call those: "number of the cube"."""
    ends: Mapping[str, str] = dataclasses.field(default_factory=dict)
    """Where or how an episode ends, by its name: "at the step limit"."""

    @property
    def goals(self) -> str:
        """Many of them."""
        return f"{self.goal}s"

    @property
    def reaches(self) -> str:
        """What it does to a goal."""
        return _third(self.reach)

    @property
    def handles(self) -> str:
        """What it does about a target."""
        verb, _, rest = self.handle.partition(" ")
        return f"{_third(verb)} {rest}"

    @property
    def targets(self) -> str:
        """Many of them."""
        return f"{self.target}s"

    def side(self, stratum: str) -> str:
        """Goals of a stratum, after their name."""
        return self.sides.get(stratum, stratum)

    def place(self, stratum: str) -> str:
        """Places of a stratum, after their name."""
        return self.places.get(stratum, stratum)

    def ending(self, end: str) -> str:
        """How an episode ends."""
        return self.ends.get(end, f"by {end.replace('_', ' ')}")

    def label(self, by: str) -> str:
        """What classes are made by."""
        return self.labels.get(by, by)

    def failing(self, by: str, value: str) -> str:
        """Where it fails."""
        if by == "end":
            return f"by ending {self.ending(value)}"
        if by == "side":
            return f"with {self.goals} {self.side(value)}"
        exact = self.classes.get(f"{by}={value}")
        template = exact or self.classes.get(by, f"where {by} is {{value}}")
        return template.replace("{value}", value)

    def as_dict(self) -> dict[str, Any]:
        """As in files."""
        return {
            k: dict(v) if isinstance(v, Mapping) else v for k, v in dataclasses.asdict(self).items()
        }


def _third(verb: str) -> str:
    """The third person: "passes", "collects"."""
    return f"{verb}es" if verb.endswith(("s", "sh", "ch", "x")) else f"{verb}s"


CUBES = TaskVocabulary(
    goal="cube",
    reach="collect",
    reached="collected",
    target="cube",
    handle="collect the cube",
    handled="collected",
    unhandled="missed",
    sides={"left": "on its left", "ahead": "ahead", "right": "on its right"},
    places={"left": "on its left", "ahead": "ahead", "right": "on its right"},
    classes={
        "cube": "at the {value} cube",
        "sideways": "with cubes {value} to its side",
        "height": "with cubes {value}",
        "height=lower": "with cubes lower than itself",
        "height=level": "with cubes at its own height",
        "height=higher": "with cubes higher than itself",
    },
    labels={
        "cube": "number of the cube",
        "side": "side",
        "sideways": "distance to the side",
        "height": "height",
        "end": "how it ended",
    },
    ends={
        "all_cubes": "with every cube collected",
        "front_boundary": "behind the last cube",
        "side_boundary": "outside the field, left or right",
        "step_limit": "at the step limit",
        "lost_control": "with the drone out of control",
    },
)
"""Of cube collection, and of files that say nothing of their words."""


PILLARS = TaskVocabulary(
    goal="row",
    reach="pass",
    reached="passed",
    target="pillar",
    handle="get past the pillar",
    handled="flown around",
    unhandled="touched, or never passed",
    follows=False,
    sides={
        "left": "that call for a turn left",
        "ahead": "that are open straight ahead",
        "right": "that call for a turn right",
    },
    places={
        "left": "that call for a turn left",
        "ahead": "that leave the way free",
        "right": "that call for a turn right",
    },
    classes={"row": "at the {value} row", "gap": "at gaps of {value}"},
    labels={
        "row": "number of the row",
        "side": "nearest way through",
        "gap": "width of the gap",
        "end": "how it ended",
    },
    ends={
        "finish_line": "at the line",
        "pillar_touched": "by touching a pillar",
        "side_boundary": "outside the field, left or right",
        "step_limit": "at the step limit",
        "lost_control": "with the drone out of control",
    },
)


def terms_of(evidence: Mapping[str, Any]) -> TaskVocabulary:
    """The words of whatever the evidence is about.

    Args:
        evidence: `verdict.json`, `explanation.json` or what a card is made of.

    Raises:
        InputError: They are none.
    """
    return (
        TaskVocabulary(**_FIELDS.read(evidence["terms"], "terms")) if "terms" in evidence else CUBES
    )


class _Phrases:
    """The kind of value that gives phrases by name."""

    def read(self, value: Any, where: str) -> dict[str, str]:
        """See `drone_rl.utils.schema.Kind`."""
        given = as_mapping(value, where)
        if len(given) > MOST:
            raise InputError(f"{where} holds {len(given)} phrases; give at most {MOST}")
        phrase = Text(LONGEST)
        return {phrase.read(k, where): phrase.read(v, f"{where}.{k}") for k, v in given.items()}


def _kind(field: dataclasses.Field) -> Kind:
    if field.type in (bool, "bool"):
        return Flag()
    return Text(LONGEST) if field.type in (str, "str") else _Phrases()


_FIELDS = Record({field.name: _kind(field) for field in dataclasses.fields(TaskVocabulary)})


_NUMBERS = {1: "one cube", 2: "two cubes", 3: "three cubes", 4: "four cubes", 5: "five cubes"}


def some_cubes(task: Mapping[str, Any]) -> str:
    """The cubes of a task.

    Args:
        task: Its settings, or a file's, which may be of before there were other tasks.
    """
    cubes = _NUMBERS.get(task["num_cubes"], f"{task['num_cubes']} cubes")
    return (
        f"{cubes} of {task['cube_size']:g} m, up to {task['lateral_bound']:g} m to either side "
        f"and {task['vertical_bound']:g} m up or down"
    )


MOST_ACTIONS = 16
_NAME = re.compile(r"[a-z][a-z0-9 _-]{0,23}")


@dataclasses.dataclass(frozen=True)
class ShownActions:
    """Actions by number, as `explanation.json` describes them under "actions"."""

    names: tuple[str, ...]
    order: tuple[int, ...]
    """All of them from left to right."""
    arrows: tuple[tuple[float, float], ...]
    """Where each points on the page: to the right and up; 0, 0 if nowhere."""
    colors: tuple[tuple[int, int, int], ...]
    """Red, green, blue, 0 to 255."""
    speeds: tuple[float, float, float] | None = None
    """The greatest, where actions are speeds: forward and to a side, m/s; of turning, degrees/s."""

    def css(self, action: int) -> str:
        """The colour of an action, as style sheets have it."""
        return "#{:02x}{:02x}{:02x}".format(*self.colors[action])


SHOWN_MOVES = ShownActions(
    ("forward", "left", "right"),
    (1, 0, 2),
    ((0.0, 1.0), (-1.0, 0.0), (1.0, 0.0)),
    ((214, 39, 40), (44, 160, 44), (31, 96, 200)),
)
"""The chapter's three, which files describe that say nothing of actions. Red forward, green left,
blue right, as in Figs. 7 and 8."""


def shown_actions(numbers: Mapping[str, Any]) -> ShownActions:
    """The actions of an explanation.

    Args:
        numbers: `explanation.json`.

    Raises:
        InputError: They contradict themselves, or are out of bounds.
    """
    if "actions" not in numbers:
        return SHOWN_MOVES
    given = _ACTION_FIELDS.read(numbers["actions"], "actions")
    names, count = given["names"], len(given["names"])
    if len(set(names)) < count or sorted(given["order"]) != list(range(count)):
        raise InputError(f"actions of order {shown(str(given['order']))} are not all there, once")
    if not len(given["arrows"]) == len(given["colors"]) == count:
        raise InputError(f"actions have {count} names; give each an arrow and a colour")
    speeds = given.get("speeds")
    return ShownActions(names, given["order"], given["arrows"], given["colors"], speeds)


class _Name:
    """The kind of text that may be an action's name: it stands in pages and tables."""

    def read(self, value: Any, where: str) -> str:
        """See `drone_rl.utils.schema.Kind`."""
        text = Text(24).read(value, where)
        if not _NAME.fullmatch(text):
            raise InputError(f"{where}={shown(value)} is no action's name; give small letters")
        return text


_INDICES = Several(Whole(0, MOST_ACTIONS - 1), 1, MOST_ACTIONS)
_ACTION_FIELDS = Record(
    {
        "names": Several(_Name(), 1, MOST_ACTIONS),
        "order": _INDICES,
        "arrows": Several(Several(Real(-1.0, 1.0), 2, 2), 1, MOST_ACTIONS),
        "colors": Several(Several(Whole(0, 255), 3, 3), 1, MOST_ACTIONS),
        "mirrored": _INDICES,
        "left": Whole(0, MOST_ACTIONS - 1),
        "speeds": Several(Real(0.0, 1e6), 3, 3),
    },
    optional=frozenset({"mirrored", "left", "speeds"}),
)
