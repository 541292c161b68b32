"""Charts of the tests that heat maps are put to, and of where the heat lies."""

from collections.abc import Callable

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from drone_rl.explanations.report.explanation import Explanation
from drone_rl.explanations.report.truth_text import NAMES

_METHOD, _PLACEBO = "#4269d0", "#b4b8c0"


def truth_chart(explanation: Explanation) -> Figure:
    """Methods beside placebos: what they score, and the tests that a method must pass."""
    truth = explanation.numbers["truth"]
    figure = Figure(figsize=(17, 4.6), layout="constrained")
    axes = figure.subplots(1, 4, width_ratios=(2, 1.3, 1.3, 1.3))
    _scores(axes[0], truth)
    _test(axes[1], truth, _hardest, 0.0, "score above its strongest placebo\n(must be above 0)")
    _test(axes[2], truth, lambda m: m.get("pointing"), 0.0, "hits above chance\n(must be above 0)")
    _test(
        axes[3],
        truth,
        lambda m: m.get("likeness"),
        0.5,
        "likeness on shuffled weights\n(must be below 0.5)",
    )
    for axis in axes[2:]:
        axis.set_yticklabels([])
    return figure


def heat_chart(explanation: Explanation) -> Figure:
    """Where the heat of each method lies."""
    figure = Figure(figsize=(9, 3.2), layout="constrained")
    _heat(figure.subplots(), explanation.numbers["truth"]["heat"])
    return figure


def _name(method: str) -> str:
    return NAMES.get(method, method)


def _scores(axis: Axes, truth: dict) -> None:
    placebos = sorted(truth["placebos"].items(), key=lambda item: -(item[1]["mean"] or 0.0))
    rows = [(_name(n), m["score"], _METHOD) for n, m in truth["methods"].items()]
    rows += [(f"placebo: {n}", score, _PLACEBO) for n, score in placebos]
    for y, (_, score, color) in enumerate(rows[::-1]):
        if score["mean"] is None:
            axis.text(0.02, y, "nothing moves the policy", va="center", fontsize=9)
            continue
        axis.barh(y, score["mean"], color=color, height=0.65)
        axis.plot([score["lower95"], score["upper95"]], [y, y], color="black", lw=1.5)
    axis.axvline(0, color="#8b8f98", lw=1)
    axis.set(yticks=range(len(rows)), yticklabels=[name for name, *_ in rows[::-1]], xlim=(-0.5, 1))
    axis.set_title(
        "tells which patches move the policy\n(score; chance: 0; line: 95%)", fontsize=11
    )


def _hardest(method: dict) -> dict | None:
    """The comparison with that placebo which the method beats least surely."""
    comparisons = method.get("placebos", {}).values()
    return min(comparisons, key=lambda b: -1.0 if b["lower"] is None else b["lower"], default=None)


def _test(
    axis: Axes, truth: dict, of: Callable[[dict], dict | None], bar: float, title: str
) -> None:
    names = list(truth["methods"])[::-1]
    for y, name in enumerate(names):
        test = of(truth["methods"][name])
        if test is None:
            continue
        if test["lower"] is None:
            axis.text(bar, y, "too few flights", va="center", fontsize=9)
            continue
        axis.plot([test["lower"], test["upper"]], [y, y], color="black", lw=1.5)
        axis.plot(test["median"], y, "o", color=_METHOD)
    axis.axvline(bar, color="#c62828", ls="--", lw=1.2)
    axis.set(
        yticks=range(len(names)),
        yticklabels=[_name(n) for n in names],
        ylim=(-0.6, len(names) - 0.4),
    )
    axis.set_title(title, fontsize=11)


def _heat(axis: Axes, heat: dict) -> None:
    regions = list(next(iter(heat.values())))
    shades = ("#d62728", "#ff9896", "#222222", "#8c9a7b", "#9ecae9")
    rows = [*heat, None]
    for y, name in zip(range(len(rows) - 1, -1, -1), rows, strict=True):
        shares = heat[name or next(iter(heat))]
        left = 0.0
        for region, shade in zip(regions, shades, strict=True):
            value = shares[region]["share" if name else "chance"]["mean"] or 0.0
            label = region.replace("_", " ") if name is None else None
            axis.barh(y, value, left=left, color=shade, height=0.7, label=label)
            left += value
    axis.set(
        yticks=range(len(rows)), yticklabels=["the pixels", *(_name(n) for n in [*heat][::-1])]
    )
    axis.set_xlim(0, 1)
    axis.legend(loc="upper center", bbox_to_anchor=(0.5, -0.06), ncols=5, fontsize=8, frameon=False)
