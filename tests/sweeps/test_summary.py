"""Groups, fractions, medians and the best run of a sweep, by hand."""

import csv
import io
import math

import numpy as np
import pytest

from drone_rl.sweeps.rows import read_rows
from drone_rl.sweeps.summary import (
    make_groups,
    median_band,
    median_of_runs,
    on_grid,
    summarise_sweep,
    to_csv,
)
from drone_rl.utils.intervals import proportion


def summary_of(sweep):
    return summarise_sweep(sweep, read_rows(sweep))


def groups(sweep):
    return make_groups(read_rows(sweep))


def test_the_best_run_reaches_the_largest_fraction_of_its_goals(begin_sweep, make_verdict):
    """A fraction of 0.7 of five cubes is more cubes than all of three, but not better."""
    many = {"largest_reward": 5, "running_reward": 3.5, "verdict": make_verdict("poor", whole=0.7)}
    few = {"largest_reward": 2, "running_reward": 1.8, "verdict": make_verdict(whole=0.95)}
    sweep = begin_sweep({"task.num_cubes=5": many, "task.num_cubes=1": few})
    assert summary_of(sweep).best.run == 1


def test_the_best_of_equal_runs_took_the_fewest_frames(begin_sweep, make_verdict):
    verdict = {"verdict": make_verdict()}
    sweep = begin_sweep({"seed=0": {**verdict, "frames": 2000}, "seed=1": verdict, "seed=2": {}})
    assert summary_of(sweep).best.run == 1


def test_no_run_is_best_without_a_verdict(begin_sweep):
    summary = summary_of(begin_sweep({"seed=0": {}, "seed=1": {"verdict": {"rule": "another"}}}))
    assert summary.best is None
    assert (summary.finished, summary.judged) == (2, 0)


def test_commands_of_the_summary(sweep, monkeypatch):
    monkeypatch.chdir(sweep.folder.parent)
    summary, name = summary_of(sweep), sweep.folder.name
    assert summary.best.report_command == f"drone-rl verdict policy={name}/0"
    assert summary.judge_command == f"drone-rl sweep-report folder={name} judge=true"
    assert summary.best.command == "drone-rl train optimizer.lr=1e-3 seed=0 logger=csv"


def test_counts_of_the_summary(sweep):
    summary = summary_of(sweep)
    states = ("finished", "failed", "unfinished", "judged", "certain")
    assert [getattr(summary, state) for state in states] == [3, 1, 0, 3, 2]
    assert summary.episodes == [200]
    assert summary.groups[1].solved.successes == 0


def test_the_table_has_a_line_a_run(sweep):
    table = list(csv.DictReader(io.StringIO(to_csv(read_rows(sweep)))))
    assert [row["verdict"] for row in table] == ["good", "good", "one-sided (right)", ""]
    assert [row["certain"] for row in table] == ["True", "True", "False", ""]
    assert table[2]["left"] == "0.0"
    assert to_csv([]).strip() == ""


def test_groups_are_runs_that_differ_in_their_seed_alone(sweep):
    low, high = groups(sweep)
    assert low.settings["optimizer.lr"] == "1e-3"
    assert low.solved.successes == 2
    assert low.frames_to_solve.median == 1500
    assert low.seconds_to_solve.median == 2
    assert low.verdicts["good"].share == 1.0
    assert low.verdicts["good"].lower95 == pytest.approx(0.025**0.5)  # exact, 2 of 2
    assert (high.failed, high.unfinished, high.runs) == (1, 0, 2)


def test_failed_runs_count(begin_sweep, make_verdict):
    (group,) = groups(
        begin_sweep(
            {f"seed={i}": "NaN" for i in range(9)} | {"seed=9": {"verdict": make_verdict()}}
        )
    )
    assert group.solved == proportion(1, 10)
    assert group.verdicts["good"].share == 0.1
    assert group.verdicts["good"].upper95 == proportion(1, 10).upper95
    assert group.verdicts["failed"].share == 0.9
    assert group.frames_to_solve.median is None
    assert group.frames_to_solve.more_than == 1000  # what they had when they failed
    assert group.final_share.median == 0.0


def test_unsolved_runs_are_censored(begin_sweep):
    never = {"frames": 9000, "reason": "frames"}
    runs = {f"seed={i}": {"frames": 1000} for i in range(2)}
    (group,) = groups(begin_sweep(runs | {"seed=2": never, "seed=3": never}))
    assert (group.frames_to_solve.median, group.solved.share) == (None, 0.5)
    assert group.frames_to_solve.more_than == 5000


def test_verdicts_are_fractions_of_runs_that_were_judged_or_failed(begin_sweep, make_verdict):
    runs = {"seed=0": {"verdict": make_verdict()}, "seed=1": {"verdict": {"rule": "another"}}}
    (group,) = groups(begin_sweep(runs | {"seed=2": "NaN"}))
    fractions = {kind: share.share for kind, share in group.verdicts.items() if share.successes}
    assert fractions == {"good": 0.5, "failed": 0.5}
    assert group.solved == proportion(2, 3)


def test_a_run_with_unreadable_files_failed_and_an_unfinished_one_is_left_out(begin_sweep):
    sweep = begin_sweep({"seed=0": {}, "seed=1": {"frames": "many"}, "seed=2": None})
    (group,) = groups(sweep)
    assert (group.runs, group.failed, group.unfinished) == (3, 1, 1)
    assert group.solved == proportion(1, 2)


def test_the_median_has_an_interval_from_six_runs_on():
    three = median_of_runs([5.0, 1.0, 3.0])
    assert (three.median, three.more_than, three.lower95, three.upper95) == (3.0, *[None] * 3)
    six = median_of_runs([6.0, 1, 2, 3, 4, 5])  # all six above the median: 2 * 0.5**6 = 3%
    assert (six.median, six.lower95, six.upper95) == (3.5, 1.0, 6.0)
    assert median_of_runs([]).median is None


def test_a_censored_median_has_a_lower_bound():
    never = math.inf
    late = median_of_runs([10.0, 20.0, 900.0], [10.0, 20.0, 900.0])
    lost = median_of_runs([10.0, 20.0, never], [10.0, 20.0, 900.0])
    assert late.median == lost.median == 20.0  # the middle one is known in both
    most = median_of_runs([10.0, never, never], [10.0, 30.0, 900.0])
    assert (most.median, most.more_than) == (None, 30.0)


def test_an_interval_with_censored_runs_has_no_upper_end():
    had = [10.0, 20, 30, 40, 900, 900]
    figure = median_of_runs([10.0, 20, 30, 40, math.inf, math.inf], had)
    assert (figure.median, figure.lower95, figure.upper95) == (35.0, 10.0, None)
    none = median_of_runs([math.inf] * 6, had)
    assert (none.more_than, none.lower95, none.upper95) == (35.0, 10.0, None)


def test_a_band_is_the_interval_at_each_place():
    values = np.array([[1.0, 60], [2, 50], [3, 40], [4, 30], [5, 20], [6, 10]])
    lower, upper = median_band(values)
    assert lower.tolist() == [1, 10]
    assert upper.tolist() == [6, 60]
    assert median_band(values[:5]) is None  # five hold the median only 94% of the time


def test_the_band_of_six_covers_the_median_as_often_as_it_says():
    draws = np.random.default_rng(0).exponential(size=(6, 4000))
    lower, upper = median_band(draws)
    covered = (lower <= math.log(2)) & (math.log(2) <= upper)
    assert 0.96 < covered.mean() < 0.978  # 1 - 2 * 0.5**6 = 0.969


def test_a_curve_starts_at_zero_and_stays_where_it_ended():
    x, y = np.array([10.0, 20.0]), np.array([1.0, 2.0])
    np.testing.assert_array_equal(on_grid(x, y, np.array([0, 10, 15, 99.0])), [0, 1, 1.5, 2])
    np.testing.assert_array_equal(on_grid(x[:0], y[:0], np.zeros(2)), [0, 0])
