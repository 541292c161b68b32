"""Report section "importance": the effect of each input of a policy that has several."""

from matplotlib.figure import Figure

from drone_rl.explanations.report.part import Part
from drone_rl.explanations.report.truth import Row, interval_chart
from drone_rl.explanations.results import Importance
from drone_rl.utils.palette import FAINT, GOOD, MUTED, css


def effects_chart(importance: Importance) -> Figure:
    """Plot the effect of each input above that of its placebo."""
    rows = []
    for name, one in importance.inputs.items():
        color = css(GOOD if one.matters else FAINT)
        rows.append(Row(name, color, *one.effect.model_dump().values()))
        placebo = f"placebo: {name} measured again"
        rows.append(Row(placebo, css(MUTED), *one.placebo.model_dump().values()))
    title = "change of the action probabilities\n(median of episodes; line: 99.8%)"
    return interval_chart(rows, importance.least, title)


PART = Part(
    title="Importance of the inputs",
    label="Inputs",
    draw=lambda importance, _: {"importance": effects_chart(importance)},
)
