"""Under which conditions it is good: curves, what the camera shows there, and ranges."""

from collections.abc import Mapping
from typing import Any

from drone_rl.evaluation.plots.saving import Rows
from drone_rl.explanations.report.explanation import Explanation
from drone_rl.explanations.report.part import Drawn, Part
from drone_rl.robustness import charts as shifts
from drone_rl.robustness.domain_text import QUOTED, is_quoted
from drone_rl.robustness.shifts_text import rows


def draw(explanation: Explanation) -> Drawn:
    """Curves, and strips of pictures; nothing of what is not believed."""
    if not is_quoted(explanation.numbers):
        return {}
    numbers = explanation.numbers["shifts"]
    pictures = {name: [*explanation.arrays[f"shifts_{name}"]] for name in numbers["axes"]}
    return {
        "shifts": shifts.chart(numbers),
        "conditions": shifts.strips(numbers, pictures),
    }


def tables(explanation: Explanation) -> dict[str, Rows]:
    """Success at every strength."""
    return {"shifts": rows(explanation.numbers["shifts"])} if is_quoted(explanation.numbers) else {}


def extras(explanation: Explanation) -> Mapping[str, Any]:
    """The table."""
    return {"rows": tables(explanation).get("shifts", [])}


PART = Part(
    title="Under which conditions it is good",
    label="Conditions",
    place=15,
    needs=("shifts",),
    words={"shifts": QUOTED},
    draw=draw,
    tables=tables,
    extras=extras,
)
