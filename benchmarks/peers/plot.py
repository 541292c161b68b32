"""Learning curves of the compared learners over time."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from benchmarks.peers.outcome import TARGET, Curve
from benchmarks.peers.settings import LABELS, OURS
from drone_rl.utils.palette import BAD, FAINT, FORWARD, GOOD, LEFT, MUTED, RIGHT, css

COLORS = dict(zip(LABELS, (RIGHT, GOOD, FORWARD, LEFT, BAD, MUTED), strict=True))
"""Color of each learner."""


def plot(curves: Mapping[str, Sequence[Curve]], path: Path) -> None:
    """Plot the running reward over seconds since the start of the process, a line for each seed.

    A dot ends each line. Third-party learners have dashed lines.

    Args:
        curves: By name of the learner, the learning curve for each seed.
        path: Path of the image.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 4), layout="constrained")
    axes = figure.subplots()
    axes.axhline(TARGET, color=css(FAINT), linewidth=1)
    axes.text(0.1, TARGET, f"solved: {TARGET}", color=css(FAINT), va="bottom")
    for name, of_seeds in curves.items():
        color, style = css(COLORS[name]), "-" if name in OURS else "--"
        for number, curve in enumerate(of_seeds):
            seconds, rewards = zip(*curve, strict=True)
            label = None if number else LABELS[name]
            axes.plot(seconds, rewards, style, color=color, linewidth=1.6, label=label)
            axes.plot(seconds[-1], rewards[-1], "o", color=color, markersize=5)
    axes.set_title("Learning curves, imports included (one line per seed)", loc="left")
    axes.set(xlabel="seconds since the start of the process", xlim=(0, None), ylim=(0, 3.25))
    axes.set_ylabel("cubes per episode (running mean)")
    axes.spines[["top", "right"]].set_visible(False)
    figure.legend(loc="outside right center", frameon=False)
    figure.savefig(path, dpi=120)
