"""Report section "truth": tests of heat maps, and the effects of changes to a scene."""

import textwrap
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image

from drone_rl.explanations.report.part import METHOD_NAMES, Part
from drone_rl.explanations.results import Explanation, Median, MethodTest, Truth
from drone_rl.trust.plots import images
from drone_rl.trust.plots.saving import new_chart
from drone_rl.utils.intervals import Mean
from drone_rl.utils.palette import FAINT, GOOD, INK, MUTED, css

_NO_EFFECT = "no patch of any frame\naffects this policy"
_TESTS: Mapping[str, tuple[float, Callable[[MethodTest], Median | None]]] = {
    "score above its strongest placebo\n(must be above 0)": (0.0, lambda of: of.weakest),
    "hits above chance\n(must be above 0)": (0.0, lambda of: of.pointing),
    "similarity on shuffled weights\n(must be below 0.5)": (0.5, lambda of: of.likeness),
}
"""Limit and result of each test, by the title of its chart."""


class Row(NamedTuple):
    """A value with an interval, which is not known with too few episodes."""

    label: str
    color: str
    value: float | None
    lower: float | None
    upper: float | None


def truth_charts(truth: Truth) -> dict[str, Figure]:
    """Plot the scores of methods and placebos, and the tests that a method must pass."""
    colors = {name: css(GOOD if of.trusted else FAINT) for name, of in truth.methods.items()}
    ordered = sorted(truth.placebos.items(), key=lambda item: -(item[1].mean or 0.0))
    methods = truth.methods.items()
    scores = [_score_row(METHOD_NAMES[n], colors[n], of.score) for n, of in methods]
    scores += [_score_row(f"placebo: {name}", css(MUTED), score) for name, score in ordered]
    title = "agreement with the patches\nthat affect the policy\n(score; chance: 0; line: 95%)"
    charts = [interval_chart(scores, 0.0, title)]
    for title, (limit, result_of) in _TESTS.items():
        rows = []
        for name, method in methods:
            result = result_of(method)
            ends = (result.median, result.lower, result.upper) if result else (None, None, None)
            rows.append(Row(METHOD_NAMES[name], colors[name], *ends))
        charts.append(interval_chart(rows, limit, title))
    return {chart.axes[0].get_title().replace("\n", " "): chart for chart in charts}


def _score_row(label: str, color: str, score: Mean) -> Row:
    return Row(label, color, score.mean, score.lower95, score.upper95)


def interval_chart(rows: Sequence[Row], limit: float, title: str) -> Figure:
    """Plot values with their intervals, the first on top, and a limit."""
    figure, axis = new_chart(height=1.6 + 0.3 * len(rows))
    for y, row in enumerate(reversed(rows)):
        if row.value is None:
            continue
        if row.lower is None or row.upper is None:
            axis.text(limit, y, " too few episodes", va="center", fontsize=9)
            continue
        axis.plot([row.lower, row.upper], [y, y], color="black", lw=1.5)
        axis.plot(row.value, y, "o", color=row.color)
    if all(row.value is None for row in rows):
        _write(axis, _NO_EFFECT if rows else "no method was tested")
    else:
        axis.axvline(limit, color=css(INK), ls="--", lw=1.2)
    labels = [textwrap.fill(row.label, 26) for row in reversed(rows)]
    axis.set_yticks(range(len(rows)), labels, fontsize=8)
    axis.set_ylim(-0.6, max(len(rows), 1) - 0.4)
    axis.set_title(title, fontsize=11)
    return figure


def _write(axis: Axes, text: str, color: str = "black") -> None:
    """Write a text in the middle of a chart."""
    place = {"transform": axis.transAxes, "ha": "center", "va": "center"}
    axis.text(0.5, 0.5, text, color=color, **place)


def effects_chart(effects: NDArray) -> Figure:
    """Plot the mean effect of each patch."""
    figure, axis = new_chart()
    image = axis.imshow(effects, cmap="magma", vmin=0, vmax=max(float(effects.max()), 1e-6))
    axis.set(xticks=[], yticks=[])
    axis.set_title("mean effect of each patch on the policy", fontsize=11)
    if not effects.any():
        _write(axis, _NO_EFFECT, "white")
    figure.colorbar(image, ax=axis, shrink=0.8, location="bottom")
    return figure


def changes(truth: Truth, explanation: Explanation) -> dict[str, Image.Image]:
    """Return one frame before and after each change to its scene, by caption."""
    if not truth.interventions:
        return {}
    captions = ["as it was"]
    for name, effect in truth.interventions.items():
        size = "not tried"
        if effect.mean is not None:
            size = f"{effect.mean:.2f} [{effect.lower95:.2f}, {effect.upper95:.2f}]"
        captions.append(f"{name}: {size}")
    frames = [explanation.data["frames"][truth.shown_frame], *truth.changed]
    pairs = zip(captions, frames, strict=True)
    return {caption: images.titled(images.enlarge(frame), caption) for caption, frame in pairs}


PART = Part(
    title="Tests of the heat maps",
    label="Tests of the heat maps",
    draw=lambda truth, explanation: {
        "truth": truth_charts(truth),
        "effects": effects_chart(truth.patch_effects),
        "interventions": changes(truth, explanation),
    },
)
