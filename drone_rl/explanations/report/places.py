"""Report section "places": the exact map of the action for each place of one cube."""

from collections.abc import Mapping
from typing import Any

from markupsafe import Markup

from drone_rl.evaluation.plots import regions
from drone_rl.evaluation.plots.saving import Rows
from drone_rl.explanations.report.explanation import Explanation
from drone_rl.explanations.report.part import Drawn, Part
from drone_rl.verification.text import PLACES, rows


def _is_made(explanation: Explanation) -> bool:
    return "refused" not in explanation.numbers["places"]


def _map(explanation: Explanation) -> tuple[Any, ...]:
    outlines = {n: explanation.arrays[f"places_{n}"] for n in ("points", "ends", "labels")}
    return explanation.numbers["places"], outlines, explanation.actions


def draw(explanation: Explanation) -> Drawn:
    """Return the map, if there is one."""
    return {"places": regions.chart(*_map(explanation))} if _is_made(explanation) else {}


def tables(explanation: Explanation) -> dict[str, Rows]:
    """Return areas by side and action."""
    if not _is_made(explanation):
        return {}
    return {"places": rows(explanation.numbers["places"], explanation.actions.names)}


def extras(explanation: Explanation) -> Mapping[str, Any]:
    """Return the map as an SVG element that can be zoomed, and its table."""
    if not _is_made(explanation):
        return {"svg": ""}
    return {
        "svg": Markup(regions.svg(*_map(explanation))),
        "rows": tables(explanation)["places"],
    }


PART = Part(
    title="Exact action map of one cube",
    label="Exact map",
    needs=("places",),
    text={"places": PLACES},
    draw=draw,
    tables=tables,
    extras=extras,
)
