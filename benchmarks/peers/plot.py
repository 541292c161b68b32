"""Bar chart of the training times."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from benchmarks.peers.settings import LABELS, THEIRS
from drone_rl.utils.palette import EMPTY, INK, MUTED, css

COLORS = {
    "start and imports": css(EMPTY),
    "training, ours": css(INK),
    "training, others": css(MUTED),
}
_SEED: dict[str, Any] = {"mfc": "white", "mec": "black", "markersize": 5}


def plot(found: Mapping[str, Mapping[str, list[Any]]], path: Path) -> None:
    """Plot a bar for each learner and a dot for each seed.

    Args:
        found: "peers" of `bench_peers`.
        path: Path of the image.
    """
    from matplotlib.figure import Figure
    from matplotlib.patches import Patch

    figure = Figure(figsize=(9, 3.6), layout="constrained")
    axes, names = figure.subplots(), list(found)
    for i, name in enumerate(names):
        seconds, trained = (found[name][k] for k in ("seconds", "seconds_without_imports"))
        whole, training = sum(seconds) / len(seconds), sum(trained) / len(trained)
        kind = "training, others" if name in THEIRS else "training, ours"
        axes.barh(i, whole - training, color=COLORS["start and imports"])
        axes.barh(i, training, left=whole - training, color=COLORS[kind])
        axes.plot(seconds, [i] * len(seconds), "o", **_SEED)
        if not all(found[name]["is_solved"]):
            axes.text(whole, i, "  not all solved", va="center")
    axes.set_yticks(range(len(names)), [LABELS[name] for name in names])
    axes.invert_yaxis()
    axes.set(xlabel="seconds from the start of the process until it is solved", xlim=(0, None))
    handles: list[Any] = [Patch(color=color, label=label) for label, color in COLORS.items()]
    handles += axes.plot([], [], "o", **_SEED, label="each seed")
    figure.legend(handles=handles, loc="outside upper center", ncols=4, frameon=False)
    figure.savefig(path, dpi=120)
