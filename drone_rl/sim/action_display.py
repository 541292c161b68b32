"""What the actions of an explanation are called, and how they are drawn."""

import dataclasses
import re
from collections.abc import Mapping
from typing import Any

from drone_rl.utils.errors import InputError
from drone_rl.utils.schema import Real, Record, Colors, Text, Whole, shown

MOST = 16
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


MOVES = ShownActions(
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
        return MOVES
    given = _FIELDS.read(numbers["actions"], "actions")
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


_NUMBERS = Several(Whole(0, MOST - 1), 1, MOST)
_FIELDS = Record(
    {
        "names": Several(_Name(), 1, MOST),
        "order": _NUMBERS,
        "arrows": Several(Several(Real(-1.0, 1.0), 2, 2), 1, MOST),
        "colors": Several(Several(Whole(0, 255), 3, 3), 1, MOST),
        "mirrored": _NUMBERS,
        "left": Whole(0, MOST - 1),
        "speeds": Several(Real(0.0, 1e6), 3, 3),
    },
    optional=frozenset({"mirrored", "left", "speeds"}),
)
