"""Charts of an explanation's numbers."""

from collections.abc import Sequence

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from drone_rl.report.explanation import ACTIONS, Explanation
from drone_rl.words.truth import NAMES

COLORS = ("#4269d0", "#efb118", "#ff725c", "#6cc5b0", "#9c6b4e")
_CHANCE = {"color": "#8b8f98", "marker": "|", "markersize": 16, "markeredgewidth": 2.5}


def truth_chart(explanation: Explanation) -> Figure:
    """Six views on whether the heat maps are true."""
    methods = explanation.numbers["truth"]["methods"]
    figure, axes = plt.subplots(2, 3, figsize=(13.5, 7.5), layout="constrained")
    _pointing(axes[0, 0], methods)
    _heat(axes[0, 1], methods)
    _causal(axes[0, 2], methods)
    random = explanation.numbers["truth"]["random_map"]
    _curves(axes[1, 0], methods, random, "deletion", "lower is better")
    _curves(axes[1, 1], methods, random, "insertion", "higher is better")
    _randomisation(axes[1, 2], methods)
    return figure


def response_chart(explanation: Explanation) -> Figure:
    """Probability of each action by where the cube stands, the chosen action, what comes of it.

    A row for each height at which cubes stand, the highest on top.
    """
    arrays = explanation.arrays
    heights = arrays["response_height"]
    figure, axes = plt.subplots(
        len(heights), 5, figsize=(16, 3.9 * len(heights)), layout="constrained", squeeze=False,
        sharex=True, sharey=True,
    )  # fmt: skip
    for layer, row in zip(range(len(heights)), axes[::-1], strict=True):
        image = _response_row(row, arrays, layer)
        level = f", cube {heights[layer]:+g} m" if len(heights) > 1 else ""
        row[0].set_ylabel(f"metres ahead{level}")
    figure.colorbar(image, ax=axes[:, :3], shrink=0.8, label="probability")
    for axis in axes[-1]:
        axis.set_xlabel("metres to the left (+) or right (-)", fontsize=9)
    for axis, labels in ((axes[-1, 3], (_SHADES, ACTIONS)), (axes[-1, 4], _OUTCOMES)):
        handles = [matplotlib.patches.Patch(color=c, label=n) for c, n in zip(*labels, strict=True)]
        axis.legend(
            handles=handles, loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=3, fontsize=8,
            frameon=False,
        )  # fmt: skip
    return figure


_SHADES = ("#d62728", "#2ca02c", "#1f60c8")
_OUTCOMES = (("#d9d9de", "#4269d0"), ("cube missed", "cube collected"))


def _response_row(
    axes: Sequence[plt.Axes], arrays: dict[str, NDArray], layer: int
) -> matplotlib.image.AxesImage:
    """The five maps of one height; returns one of the probabilities."""
    forward, lateral = arrays["response_forward"], arrays["response_lateral"]
    probabilities = arrays["response_probabilities"][layer]
    extent = (lateral[0], lateral[-1], forward[0], forward[-1])
    style = {"extent": extent, "origin": "lower", "aspect": "auto", "interpolation": "nearest"}
    for axis, action in zip(axes, (1, 0, 2), strict=False):
        image = axis.imshow(probabilities[..., action], vmin=0, vmax=1, cmap="viridis", **style)
        axis.set_title(f"P({ACTIONS[action]})")
    shades = matplotlib.colors.ListedColormap(_SHADES)
    axes[3].imshow(probabilities.argmax(-1), vmin=0, vmax=2, cmap=shades, **style)
    axes[3].set_title("most probable action\n(in the white line: blind)", fontsize=10)
    blind = arrays["response_blind"][layer]
    if blind.any():
        axes[3].contour(
            lateral, forward, blind.astype(float), levels=[0.5], colors="white", linewidths=2.5
        )
    ends = matplotlib.colors.ListedColormap(_OUTCOMES[0])
    axes[4].imshow(arrays["outcome_collected"][layer], vmin=0, vmax=1, cmap=ends, **style)
    axes[4].set_title("what comes of it", fontsize=10)
    return image


def _labels(methods: dict) -> list[str]:
    return [NAMES.get(name, name) for name in methods]


def _pointing(axis: plt.Axes, methods: dict) -> None:
    rows = np.arange(len(methods))[::-1]
    for row, (name, found) in zip(rows, methods.items(), strict=True):
        hit, chance = found["pointing"]["hit"], found["pointing"]["chance"]
        if hit["mean"] is None:
            axis.text(0.02, row, "no cube was ever in view", va="center")
            continue
        axis.barh(row, hit["mean"], color=COLORS[len(methods) - 1 - row], height=0.6)
        axis.plot([hit["lower95"], hit["upper95"]], [row, row], color="black", lw=1.5)
        axis.plot(chance["mean"], row, **_CHANCE)
        del name
    axis.set(yticks=rows, yticklabels=_labels(methods), xlim=(0, 1))
    axis.set_title(
        "brightest pixel is on the next cube\n(gray mark: chance; line: 95%)", fontsize=11
    )


def _heat(axis: plt.Axes, methods: dict) -> None:
    regions = list(next(iter(methods.values()))["heat"])
    shades = ("#d62728", "#ff9896", "#222222", "#8c9a7b", "#9ecae9")
    rows = [*methods, None]
    for y, name in zip(range(len(rows) - 1, -1, -1), rows, strict=True):
        found = methods[name or next(iter(methods))]["heat"]
        left = 0.0
        for region, shade in zip(regions, shades, strict=True):
            value = found[region]["share" if name else "chance"]["mean"] or 0.0
            label = region.replace("_", " ") if name is None else None
            axis.barh(y, value, left=left, color=shade, height=0.7, label=label)
            left += value
    axis.set(yticks=range(len(rows)), yticklabels=["pixels (chance)", *_labels(methods)[::-1]])
    axis.set_xlim(0, 1)
    axis.set_title("where the heat lies", fontsize=11)
    axis.legend(loc="upper center", bbox_to_anchor=(0.5, -0.06), ncols=5, fontsize=8, frameon=False)


def _causal(axis: plt.Axes, methods: dict) -> None:
    rows = np.arange(len(methods))[::-1]
    for row, found in zip(rows, methods.values(), strict=True):
        causal = found["causal"]
        if causal["correlation"] is None:
            axis.text(0.02, row, "nothing varied", va="center")
            continue
        axis.barh(row, causal["correlation"], color=COLORS[len(methods) - 1 - row], height=0.6)
        axis.plot([causal["lower95"], causal["upper95"]], [row, row], color="black", lw=1.5)
    axis.axvline(0, color="#8b8f98", lw=2)
    axis.set(yticks=rows, yticklabels=_labels(methods), xlim=(-0.5, 1))
    axis.set_title("claims against what changes did:\nrank correlation (chance: 0)", fontsize=11)


def _curves(axis: plt.Axes, methods: dict, random: dict, kind: str, title: str) -> None:
    share = np.linspace(0, 100, len(random[kind]["curve"]))
    for found, name, color in zip(methods.values(), methods, COLORS, strict=False):
        label = f"{NAMES.get(name, name)}: {found['curves'][kind]['area']['mean']:.2f}"
        axis.plot(share, found["curves"][kind]["curve"], color=color, label=label)
    label = f"random order: {random[kind]['area']['mean']:.2f}"
    axis.plot(share, random[kind]["curve"], color="#8b8f98", ls="--", label=label)
    axis.set(xlabel="% of the pixels", ylabel="P(chosen action)", ylim=(-0.02, 1.02))
    axis.set_title(f"{kind}: {title}", fontsize=11)
    axis.legend(fontsize=8, title="area under the curve", title_fontsize=8)


def _randomisation(axis: plt.Axes, methods: dict) -> None:
    for (name, found), color in zip(methods.items(), COLORS, strict=False):
        test = found["randomisation"]
        axis.plot([1.0, *test["correlation"]], color=color, marker="o", label=NAMES.get(name, name))
    layers = next(iter(methods.values()))["randomisation"]["layers"]
    axis.set_xticks(range(len(layers) + 1), ["trained", *layers])
    axis.axhline(0.5, color="#8b8f98", ls="--")
    axis.set(ylabel="likeness to the trained map", ylim=(-1.05, 1.05))
    axis.set_title("randomised from the last layer on:\na true map must change", fontsize=11)
    axis.legend(fontsize=8, loc="lower left")
