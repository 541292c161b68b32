"""The plots of a sweep are drawn from runs in every state; matplotlib checks the rest."""

import struct

import pytest
from matplotlib.figure import Figure

from drone_rl.sweeps import figures
from drone_rl.sweeps.rows import read_rows
from drone_rl.sweeps.summary import make_groups


def layout_of(sweep):
    return figures.lay_out(make_groups(read_rows(sweep)))


@pytest.mark.parametrize("draw", [figures.draw_curves, figures.draw_outcome])
def test_plots_of_runs_in_every_state(begin_sweep, make_verdict, draw):
    runs = {f"seed={i}": {"verdict": make_verdict()} for i in range(6)}
    others = {
        "seed=6": "NaN",
        "seed=7": None,
        "seed=8": {"verdict": make_verdict("poor", right=None, certain=False)},
        "seed=9": {"reason": "frames"},
    }
    assert draw(layout_of(begin_sweep(runs | others))).startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("learners", "size"), [(2, (1144, 825)), (3, (1430, 825)), (4, (1144, 1650))]
)
def test_learners_are_side_by_side(begin_sweep, make_verdict, learners, size):
    """Up to three in a row, the three figures of each below one another, 110 pixels an inch."""
    judged = {"verdict": make_verdict()}
    runs = {f"objective={i} optimizer.lr={lr}": judged for i in range(learners) for lr in (1, 2)}
    layout = layout_of(begin_sweep(runs))
    assert list(layout.panels) == [f"objective={i}" for i in range(learners)]
    assert struct.unpack(">II", figures.draw_outcome(layout)[16:24]) == size


def test_dots_are_at_the_places_of_their_groups(begin_sweep, make_verdict):
    judged = {"verdict": make_verdict()}
    sweep = begin_sweep(
        {f"optimizer.lr={v} seed={i}": judged for v in ("1e-3", "3e-3") for i in "01"}
    )
    layout, axes = layout_of(sweep), Figure().subplots()
    figures._entropies(axes, layout, layout.panels[""])
    dots = [float(dot.get_xdata()[0]) for dot in axes.lines if dot.get_marker() == "o"]
    assert dots == pytest.approx([0.0, 0.0, 1.0, 1.0], abs=0.1)
    assert [label.get_text() for label in axes.get_xticklabels()] == ["1e-3", "3e-3"]
