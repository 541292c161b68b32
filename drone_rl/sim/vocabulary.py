"""Terms of reports; `vocabulary.toml` has those of the built-in tasks."""

import functools
import tomllib
from pathlib import Path
from typing import Annotated, Any, Self

from pydantic import Field, StrictBool, model_validator

from drone_rl.utils import palette
from drone_rl.utils.errors import InputError
from drone_rl.utils.models import Model
from drone_rl.utils.schema import Real, Several, Text, Whole, shown

MOST = 64
"""Most phrases of a kind."""
Phrase = Annotated[str, Field(max_length=200, pattern=r"^[^\x00-\x1f\x7f-\x9f]*$")]
"""One line."""
Phrases = Annotated[dict[Phrase, Phrase], Field(max_length=MOST)]


class TaskVocabulary(Model):
    """Terms of a task, as files hold them under "terms"."""

    goal: Phrase = "goal"
    """Something to reach: "cube"."""
    reach: Phrase = "reach"
    """To do so: "collect"."""
    reached: Phrase = "reached"
    succeed: Phrase = ""
    """To end an episode with success: "stay in the air"; empty for that of reaching every goal."""
    target: Phrase = "target"
    """The thing in the image that requires an action: "cube"."""
    handle: Phrase = "reach the target"
    """To act on a target: "collect the cube"."""
    handled: Phrase = "reached"
    unhandled: Phrase = "missed"
    tested: Phrase = ""
    """The scenes of the test, for the model card: "three cubes of 2.5 m"."""
    follows: StrictBool = True
    """Whether the drone flies to a target and follows it; else it flies around it."""
    sides: Phrases = {}
    """Phrases after goals, by stratum: "on its left"."""
    places: Phrases = {}
    """Phrases after places of a single target, by stratum: "on its left"."""
    classes: Phrases = {}
    """Phrases of failures, by the variable that classifies goals: "at the {value} cube"."""
    labels: Phrases = {}
    """Names of these variables in tables: "number of the cube"."""
    ends: Phrases = {}
    """Phrases of the ends of episodes, by name: "at the step limit"."""

    @property
    def goals(self) -> str:
        """Plural of `goal`."""
        return f"{self.goal}s"

    @property
    def reaches(self) -> str:
        """Third person of `reach`."""
        return _third(self.reach)

    @property
    def succeeds(self) -> str:
        """Third person of `succeed`."""
        return _third(self.succeed) or f"{self.reaches} every {self.goal}"

    @property
    def handles(self) -> str:
        """Third person of `handle`."""
        return _third(self.handle)

    @property
    def targets(self) -> str:
        """Plural of `target`."""
        return f"{self.target}s"

    def side(self, stratum: str) -> str:
        """Return the phrase after goals of a stratum."""
        return self.sides.get(stratum, stratum)

    def place(self, stratum: str) -> str:
        """Return the phrase after places of a stratum."""
        return self.places.get(stratum, stratum)

    def ending(self, end: str) -> str:
        """Return the phrase of an episode's end."""
        return self.ends.get(end, f"by {end.replace('_', ' ')}")

    def label(self, by: str) -> str:
        """Return the name of a variable that classifies goals."""
        return self.labels.get(by, by)

    def failing(self, by: str, value: str) -> str:
        """Return the phrase of failures where a variable has a value."""
        if by == "end":
            ending = self.ending(value)
            return ending if ending.startswith("by ") else f"by ending {ending}"
        if by == "side":
            return f"with {self.goals} {self.side(value)}"
        exact = self.classes.get(f"{by}={value}")
        template = exact or self.classes.get(by, f"where {by} is {{value}}")
        return template.replace("{value}", value)

    def as_dict(self) -> dict[str, Any]:
        """Return the values that files hold."""
        return self.model_dump()


def _third(phrase: str) -> str:
    """Return a phrase that begins with a verb in the third person; "" for none."""
    verb, _, rest = phrase.partition(" ")
    if verb.endswith("y") and verb[-2:-1] not in "aeiou":
        verb = f"{verb[:-1]}ie"
    elif verb.endswith(("s", "sh", "ch", "x")):
        verb = f"{verb}e"
    return f"{verb}s {rest}".rstrip() if verb else ""


@functools.cache
def shipped_vocabulary(task: str) -> TaskVocabulary:
    """Return the terms of a shipped task, by its name."""
    path = Path(__file__).with_name("vocabulary.toml")
    return TaskVocabulary(**tomllib.loads(path.read_text(encoding="utf-8"))[task])


MOST_ACTIONS = 16


class ShownActions(Model):
    """Actions by number, as reports show them; see `Actions`."""

    names: Annotated[tuple[str, ...], Several(Text(24), 1, MOST_ACTIONS)]
    order: Annotated[tuple[int, ...], Several(Whole(0, MOST_ACTIONS - 1), 1, MOST_ACTIONS)]
    arrows: Annotated[
        tuple[tuple[float, float], ...],
        Several(Several(Real(-1.0, 1.0), 2, 2), 1, MOST_ACTIONS),
    ]
    colors: Annotated[
        tuple[palette.Rgb, ...], Several(Several(Whole(0, 255), 3, 3), 1, MOST_ACTIONS)
    ]
    speeds: Annotated[tuple[float, ...], Several(Real(0.0, 1e6), 3, 5)] | None = None
    """Greatest speeds of continuous actions: forward and sideways, m/s; yaw rate, degrees/s; then,
    m/s, climb and backward, in former files neither."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        count = len(self.names)
        if len({*self.names}) < count or sorted(self.order) != list(range(count)):
            raise InputError(
                f"order={shown(self.order)} or a name is invalid; give {count} different names, "
                "and the index of each once"
            )
        if not len(self.arrows) == len(self.colors) == count:
            raise InputError(f"actions have {count} names; give each an arrow and a color")
        return self

    def css(self, action: int) -> str:
        """Return the color of an action for style sheets."""
        return palette.css(self.colors[action])


SHOWN_MOVES = ShownActions(
    names=("forward", "left", "right"),
    order=(1, 0, 2),
    arrows=((0.0, 1.0), (-1.0, 0.0), (1.0, 0.0)),
    colors=(palette.FORWARD, palette.LEFT, palette.RIGHT),
)
"""The chapter's three moves."""
