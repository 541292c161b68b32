"""Charts of the tests of heat maps: scores, deletion and insertion, heat by region."""

import operator
from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from drone_rl.explanations.report.explanation import Explanation
from drone_rl.explanations.report.validation import METHOD_NAMES

_METHOD, _PLACEBO = "#4269d0", "#b4b8c0"
_COLORS = ("#4269d0", "#efb118", "#ff725c", "#6cc5b0", "#9c6b4e")
_REGION_COLORS = ("#d62728", "#ff9896", "#222222", "#8c9a7b", "#9ecae9")
_KINDS = {"deletion": "lower is better", "insertion": "higher is better"}


def _name(method: str) -> str:
    return METHOD_NAMES.get(method, method)


def truth_chart(explanation: Explanation) -> Figure:
    """Plot the scores of methods and placebos, and the tests that a method must pass."""
    truth = explanation.numbers["truth"]
    figure = Figure(figsize=(17, 4.6), layout="constrained")
    axes = figure.subplots(1, 4, width_ratios=(2, 1.3, 1.3, 1.3))
    _scores(axes[0], truth)
    tests = (
        ("placebos", 0.0, "score above its strongest placebo\n(must be above 0)"),
        ("pointing", 0.0, "hits above chance\n(must be above 0)"),
        ("likeness", 0.5, "similarity on shuffled weights\n(must be below 0.5)"),
    )
    for axis, (test, bar, title) in zip(axes[1:], tests, strict=True):
        of = _hardest if test == "placebos" else operator.methodcaller("get", test)
        _test(axis, {name: of(method) for name, method in truth["methods"].items()}, bar, title)
    for axis in axes[2:]:
        axis.set_yticklabels([])
    return figure


def _scores(axis: Axes, truth: Mapping[str, Any]) -> None:
    placebos = sorted(truth["placebos"].items(), key=lambda item: -(item[1]["mean"] or 0.0))
    rows = [(_name(n), m["score"], _METHOD) for n, m in truth["methods"].items()]
    rows += [(f"placebo: {n}", score, _PLACEBO) for n, score in placebos]
    for y, (_, score, color) in enumerate(rows[::-1]):
        if score["mean"] is None:
            axis.text(0.02, y, "no patch affects the policy", va="center", fontsize=9)
            continue
        axis.barh(y, score["mean"], color=color, height=0.65)
        axis.plot([score["lower95"], score["upper95"]], [y, y], color="black", lw=1.5)
    axis.axvline(0, color="#8b8f98", lw=1)
    axis.set(yticks=range(len(rows)), yticklabels=[name for name, *_ in rows[::-1]], xlim=(-0.5, 1))
    axis.set_title(
        "agreement with the patches that affect the policy\n(score; chance: 0; line: 95%)",
        fontsize=11,
    )


def _hardest(method: Mapping[str, Any]) -> Mapping[str, Any] | None:
    """Return the comparison with the placebo that the method beats least reliably."""
    comparisons = method.get("placebos", {}).values()
    return min(comparisons, key=lambda b: -1.0 if b["lower"] is None else b["lower"], default=None)


def _test(axis: Axes, results: dict[str, Mapping[str, Any] | None], bar: float, title: str) -> None:
    """Plot the median and the bounds of one test for each method, the first on top."""
    for y, test in enumerate(reversed(results.values())):
        if test is not None and test["lower"] is None:
            axis.text(bar, y, "too few episodes", va="center", fontsize=9)
        elif test is not None:
            axis.plot([test["lower"], test["upper"]], [y, y], color="black", lw=1.5)
            axis.plot(test["median"], y, "o", color=_METHOD)
    axis.axvline(bar, color="#c62828", ls="--", lw=1.2)
    names = [_name(method) for method in reversed(results)]
    axis.set(yticks=range(len(names)), yticklabels=names, ylim=(-0.6, len(names) - 0.4))
    axis.set_title(title, fontsize=11)


def heat_chart(explanation: Explanation) -> Figure:
    """Plot the fraction of each method's heat in each region of the frame."""
    figure = Figure(figsize=(9, 3.2), layout="constrained")
    axis, heat = figure.subplots(), explanation.numbers["truth"]["heat"]
    first = next(iter(heat.values()))
    bars = [*((shares, "share") for shares in heat.values()), (first, "chance")]
    for y, (shares, of) in zip(range(len(heat), -1, -1), bars, strict=True):
        left = 0.0
        for region, color in zip(first, _REGION_COLORS, strict=True):
            value = shares[region][of]["mean"] or 0.0
            label = region.replace("_", " ") if of == "chance" else None
            axis.barh(y, value, left=left, color=color, height=0.7, label=label)
            left += value
    names = ["the pixels", *(_name(method) for method in reversed(heat))]
    axis.set(yticks=range(len(names)), yticklabels=names, xlim=(0, 1))
    axis.legend(loc="upper center", bbox_to_anchor=(0.5, -0.06), ncols=5, fontsize=8, frameon=False)
    return figure


def curves_chart(explanation: Explanation) -> Figure:
    """Plot the mean effect of each patch, and deletion and insertion by action."""
    curves = explanation.numbers["truth"]["curves"]
    actions = explanation.actions
    columns = 1 + len(actions.names)
    figure = Figure(figsize=(max(17.0, 3.8 * columns), 7), layout="constrained")
    axes = figure.subplots(2, columns)
    _effects(axes[0, 0], explanation)
    axes[1, 0].axis("off")
    shown = [actions.names[action] for action in actions.order]
    for column, action in zip(axes.T[1:], shown, strict=True):
        for axis, (kind, better) in zip(column, _KINDS.items(), strict=True):
            _curves(axis, curves, action, kind)
            axis.set_title(f"{action}, {kind}\n({better})", fontsize=11)
    handles, labels = axes[0, 2].get_legend_handles_labels()
    axes[1, 0].legend(handles, labels, loc="center", fontsize=9, frameon=False)
    return figure


def _effects(axis: Axes, explanation: Explanation) -> None:
    effects = explanation.arrays["patch_effects"]
    image = axis.imshow(effects, cmap="magma", vmin=0, vmax=max(float(effects.max()), 1e-6))
    axis.set(xticks=[], yticks=[])
    axis.set_title("mean effect of each patch\non the policy", fontsize=11)
    axis.figure.colorbar(image, ax=axis, shrink=0.8, location="bottom")


def _curves(axis: Axes, curves: Mapping[str, Any], action: str, kind: str) -> None:
    share = 100 * np.array(curves["shares"])
    colors = dict(zip(METHOD_NAMES, _COLORS, strict=True))
    methods = {name: by_action[action] for name, by_action in curves.items() if name != "shares"}
    named_placebo = False
    for name, found in methods.items():
        curve = found[kind]["curve"]
        points = curve if curve is not None else np.full(len(share), np.nan)
        if name in METHOD_NAMES:
            axis.plot(share, points, color=colors[name], label=METHOD_NAMES[name])
        else:
            label = None if named_placebo else "placebos"
            axis.plot(share, points, color=_PLACEBO, ls="--", lw=1, label=label, zorder=0)
            named_placebo = True
    axis.set_xscale("symlog", linthresh=1)
    axis.set(xlim=(0, 100), ylim=(-0.02, 1.02), xlabel="% of the pixels", ylabel="P(chosen action)")
    axis.set_xticks([0, 1, 3, 10, 30, 100], ["0", "1", "3", "10", "30", "100"])
    if all(found["frames"] == 0 for found in methods.values()):
        axis.text(10, 0.5, "never taken", ha="center")
