"""Which patches move the policy, and curves of deletion and insertion for each action."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from drone_rl.explanations.report.explanation import Explanation
from drone_rl.explanations.report.truth_text import NAMES

_COLORS = ("#4269d0", "#efb118", "#ff725c", "#6cc5b0", "#9c6b4e")
_PLACEBO = "#b4b8c0"
_KINDS = {"deletion": "lower is better", "insertion": "higher is better"}


def curves_chart(explanation: Explanation) -> Figure:
    """The mean effect of each patch; deletion and insertion by action, placebos dashed."""
    curves = explanation.numbers["truth"]["curves"]
    columns = 1 + len(explanation.actions.names)
    figure = Figure(figsize=(max(17.0, 3.8 * columns), 7), layout="constrained")
    axes = figure.subplots(2, columns)
    _effects(axes[0, 0], explanation)
    axes[1, 0].axis("off")
    actions = explanation.actions
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
    axis.set_title("how far each patch of the picture\nmoves the policy, on average", fontsize=11)
    axis.figure.colorbar(image, ax=axis, shrink=0.8, location="bottom")


def _curves(axis: Axes, curves: dict, action: str, kind: str) -> None:
    share = 100 * np.array(curves["shares"])
    colors = dict(zip(NAMES, _COLORS, strict=True))
    named_placebo = False
    for name, curve_of in curves.items():
        if name == "shares":
            continue
        curve = curve_of[action][kind]["curve"]
        points = curve if curve is not None else np.full(len(share), np.nan)
        if name in NAMES:
            axis.plot(share, points, color=colors[name], label=NAMES[name])
        else:
            label = None if named_placebo else "placebos"
            axis.plot(share, points, color=_PLACEBO, ls="--", lw=1, label=label, zorder=0)
            named_placebo = True
    axis.set_xscale("symlog", linthresh=1)
    axis.set(xlim=(0, 100), ylim=(-0.02, 1.02), xlabel="% of the pixels", ylabel="P(chosen action)")
    axis.set_xticks([0, 1, 3, 10, 30, 100], ["0", "1", "3", "10", "30", "100"])
    if all(curve_of[action]["frames"] == 0 for n, curve_of in curves.items() if n != "shares"):
        axis.text(10, 0.5, "never taken", ha="center")
