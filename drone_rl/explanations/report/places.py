"""Report section "places": the exact map of the action over one cube's place."""

from collections.abc import Mapping, Sequence
from typing import Any

from drone_rl.explanations.report.part import Figures, Part
from drone_rl.explanations.results import Explanation
from drone_rl.trust.plots import regions
from drone_rl.utils.text import exact_percent, render

WHERE = {"left": "on its left", "ahead": "straight ahead", "right": "on its right"}


def rows(places: Mapping[str, Any], names: Sequence[str]) -> list[list[str]]:
    """Return a map of actions by positions as rows of a table, one for each side, the header first.

    `places` is "places" of an explanation, or `places.json`.
    """
    head = ["one cube", "share of places", *names, "not seen", "blind"]
    every = {**{n: places[n] for n in ("actions", "unseen", "blind")}, "share": 1.0}
    by_side = {WHERE[s]: of for s, of in places["sides"].items()} | {"anywhere": every}
    return [
        head,
        *(
            [where, *map(exact_percent, (of["share"], *of["actions"], of["unseen"], of["blind"]))]
            for where, of in by_side.items()
        ),
    ]


def describe(places: Mapping[str, Any], names: Sequence[str]) -> str:
    """Return what the exact map shows in words, or why there is none."""
    return render("drone_rl.explanations.report", "places.j2", map=places, names=names, where=WHERE)


def draw(places: Mapping[str, Any], explanation: Explanation) -> Figures:
    """Draw the exact map, if there is one."""
    if "refused" in places:
        return {}
    return {"places": regions.chart(places, places["outlines"], explanation.actions)}


def values(places: Mapping[str, Any], explanation: Explanation) -> dict[str, Any]:
    """Return the map in words, and as a table."""
    names = explanation.actions.names
    text = {"text": describe(places, names)}
    return text if "refused" in places else {**text, "rows": rows(places, names)}


PART = Part(title="Exact action map of one cube", label="Exact map", draw=draw, values=values)
