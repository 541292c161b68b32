"""What is drawn: lines, bands and dots, as matplotlib holds them."""

import dataclasses
import struct

import numpy as np
import pytest
from matplotlib.figure import Figure

from drone_rl.sweeps import figures
from drone_rl.sweeps.rows import read_rows
from drone_rl.sweeps.summary import make_groups


def drawn(draw, sweep):
    """The axes of one panel with all groups."""
    groups = make_groups(read_rows(sweep))
    axes = Figure().subplots()
    draw(axes, figures.lay_out(groups), groups)
    return axes


@pytest.mark.parametrize(("runs", "lines", "bands"), [(3, 3, 0), (5, 5, 0), (6, 1, 1)])
def test_few_runs_are_lines_and_many_are_a_band(begin_sweep, runs, lines, bands):
    axes = drawn(figures._curves, begin_sweep({f"seed={i}": {} for i in range(runs)}))
    assert (len(axes.lines), len(axes.collections)) == (lines, bands)
    assert axes.lines[0].get_ydata()[-1] == pytest.approx(0.5)  # 1.5 of 3 cubes


def test_curves_below_0_are_shown(begin_sweep, monkeypatch):
    rows = read_rows(begin_sweep({"seed=0": {}}))
    frames, rewards = rows[0].curve
    groups = make_groups([dataclasses.replace(rows[0], curve=(frames, rewards - 2.0))])
    axes = Figure().subplots()
    figures._curves(axes, figures.lay_out(groups), groups)
    assert axes.get_ylim()[0] == pytest.approx(1.05 * (rewards.min() - 2.0))


def test_failed_runs_pull_the_median_down(begin_sweep):
    sweep = begin_sweep({f"seed={i}": "NaN" for i in range(9)} | {"seed=9": {}})
    assert not drawn(figures._curves, sweep).lines[0].get_ydata().any()


def test_a_verdict_that_is_not_certain_is_a_hollow_dot(sweep):
    fills = [dot.get_fillstyle() for dot in drawn(figures._entropies, sweep).lines[:-1]]
    assert fills == ["full", "full", "none"]


def test_a_run_that_met_no_cube_on_a_side_has_no_dot(begin_sweep, make_verdict):
    sweep = begin_sweep({"seed=0": {"verdict": make_verdict(right=None)}, "seed=1": {}})
    assert len(drawn(figures._sides, sweep).lines) == 1  # the line at 0


def test_failures_have_a_share_of_their_own(sweep):
    axes = drawn(figures._verdicts, sweep)
    shares = {bar.lines[0].get_color(): bar.lines[0].get_ydata() for bar in axes.containers}
    np.testing.assert_array_equal(shares[figures.COLORS["good"]], [1, 0])
    np.testing.assert_array_equal(shares[figures.COLORS["one-sided"]], [0, 0.5])
    np.testing.assert_array_equal(shares[figures.COLORS["failed"]], [0, 0.5])


def test_runs_that_were_never_solved_are_open_triangles_at_what_they_had(sweep):
    axes = drawn(figures._costs, sweep)
    marks = [(d.get_marker(), d.get_fillstyle(), d.get_ydata()[0]) for d in axes.lines]
    assert marks == [
        ("o", "full", 1000),
        ("o", "full", 2000),
        ("^", "none", 1000),
        ("^", "none", 1000),
    ]
    assert axes.lines[2].get_color() != axes.lines[3].get_color() == figures.COLORS["poor"]
    assert [text.get_text() for text in axes.texts] == ["2/2", "0/2"]
    assert axes.get_ylim() == (0, 1.2 * 2000)


def test_costs_are_seen_beside_a_panel_without_any(begin_sweep):
    sweep = begin_sweep({"a=1 optimizer.lr=1": {"frames": 2000}, "a=2 optimizer.lr=1": None})
    solved, none = make_groups(read_rows(sweep))
    layout = figures.Layout("optimizer.lr", {"first": [none], "second": [solved]})
    first, second = Figure().subplots(1, 2, sharey=True)
    figures._costs(first, layout, [none])
    figures._costs(second, layout, [solved])
    assert second.get_ylim() == (0, 1.2 * 2000)


@pytest.mark.parametrize(
    ("learners", "size"), [(2, (1144, 825)), (3, (1430, 825)), (4, (1144, 1650))]
)
def test_learners_are_shown_side_by_side(begin_sweep, make_verdict, learners, size):
    """Up to three in a row, the three figures of each below one another, 110 pixels an inch."""
    judged = {"verdict": make_verdict()}
    runs = {f"objective={i} optimizer.lr={lr}": judged for i in range(learners) for lr in (1, 2)}
    layout = figures.lay_out(make_groups(read_rows(begin_sweep(runs))))
    assert list(layout.panels) == [f"objective={i}" for i in range(learners)]
    assert struct.unpack(">II", figures.draw_outcome(layout)[16:24]) == size


@pytest.mark.parametrize("values", [("1e-3", "3e-3"), ("1", "2", "2.5"), ("0.1", "1", "10")])
def test_labels_are_the_values_and_do_not_overlap(begin_sweep, make_verdict, values):
    """What `drone-rl train -m optimizer.lr=1e-3,3e-3` draws: a dot was shifted by 0.05, not 5%."""
    judged = {"verdict": make_verdict()}
    groups = make_groups(
        read_rows(begin_sweep({f"optimizer.lr={v} seed={i}": judged for v in values for i in "01"}))
    )
    figure = Figure(figsize=(5, 3), layout="constrained")
    axes = figure.subplots()
    figures._entropies(axes, figures.lay_out(groups), groups)
    figure.draw_without_rendering()
    labels = [label for label in axes.get_xticklabels(which="both") if label.get_text()]
    assert [label.get_text() for label in labels] == list(values)
    boxes = [label.get_window_extent() for label in labels]
    assert not any(a.overlaps(b) for i, a in enumerate(boxes) for b in boxes[:i])
    numbers = [float(value) for value in values]
    dots = [float(dot.get_xdata()[0]) for dot in axes.lines if dot.get_marker() == "o"]
    assert min(numbers) * 0.8 < min(dots) and max(dots) < max(numbers) * 1.2


def test_labels_that_would_overlap_are_left_out(begin_sweep):
    values = [*map(str, range(1, 30)), "1000"]
    groups = make_groups(read_rows(begin_sweep({f"optimizer.lr={v}": {} for v in values})))
    axes = Figure().subplots()
    figures._costs(axes, figures.lay_out(groups), groups)
    labels = [label.get_text() for label in axes.get_xticklabels()]
    assert [label for label in labels if label] == ["1", "3", "9", "25", "1000"]
