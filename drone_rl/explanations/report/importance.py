"""Report section "importance": the effect of each input of a policy that has several."""

from matplotlib.figure import Figure

from drone_rl.explanations.report.part import Part
from drone_rl.explanations.report.truth import interval_chart, score_row
from drone_rl.explanations.results import Importance
from drone_rl.utils.palette import FAINT, GOOD, MUTED, css


def effects_chart(importance: Importance) -> Figure:
    """Plot the effect of each input above that of its placebo."""
    rows = []
    for name, one in importance.inputs.items():
        rows.append(score_row(name, css(GOOD if one.matters else FAINT), one.effect))
        rows.append(score_row(f"placebo: {name} measured again", css(MUTED), one.control))
    return interval_chart(rows, importance.least, "probability that the action changes (line: 95%)")


PART = Part(
    title="Importance of the inputs",
    label="Inputs",
    draw=lambda importance, _: {"importance": effects_chart(importance)},
)
