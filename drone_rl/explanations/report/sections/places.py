"""What it does about one cube at each and every place, exactly."""

from collections.abc import Mapping
from typing import Any

from markupsafe import Markup
from numpy.typing import NDArray

from drone_rl.evaluation.plots import regions
from drone_rl.evaluation.plots.saving import Rows
from drone_rl.explanations.report.explanation import Explanation
from drone_rl.explanations.report.part import Drawn, Part
from drone_rl.verification.text import PLACES, rows


def _is_made(explanation: Explanation) -> bool:
    return "refused" not in explanation.numbers["places"]


def _outlines(explanation: Explanation) -> dict[str, NDArray]:
    return {name: explanation.arrays[f"places_{name}"] for name in ("points", "ends", "labels")}


def draw(explanation: Explanation) -> Drawn:
    """The map, if there is one."""
    if not _is_made(explanation):
        return {}
    numbers, ways = explanation.numbers["places"], _outlines(explanation)
    return {"places": regions.chart(numbers, ways, explanation.actions)}


def tables(explanation: Explanation) -> dict[str, Rows]:
    """Areas by side and action."""
    if not _is_made(explanation):
        return {}
    return {"places": rows(explanation.numbers["places"], explanation.actions.names)}


def extras(explanation: Explanation) -> Mapping[str, Any]:
    """The map as an element that can be zoomed into, and its table."""
    if not _is_made(explanation):
        return {"svg": ""}
    numbers, ways = explanation.numbers["places"], _outlines(explanation)
    drawn = Markup(regions.svg(numbers, ways, explanation.actions))
    return {"svg": drawn, "rows": tables(explanation)["places"]}


PART = Part(
    title="What it does about a cube at each and every place, exactly",
    label="Exact map",
    place=85,
    needs=("places",),
    words={"places": PLACES},
    draw=draw,
    tables=tables,
    extras=extras,
)
