"""Every run that ended counts, by hand."""

import json

import pytest

from drone_rl.sweeps.rows import read_rows
from drone_rl.sweeps.summary import make_groups
from drone_rl.utils.intervals import proportion


def groups(sweep):
    return [group.plain() for group in make_groups(read_rows(sweep))]


def test_groups_are_runs_that_differ_in_their_seed_alone(sweep):
    low, high = groups(sweep)
    assert low["optimizer.lr"] == "1e-3"
    assert low["solved"]["successes"] == 2
    assert low["frames_to_solve"]["median"] == 1500
    assert low["seconds_to_solve"]["median"] == 2
    assert low["verdicts"]["good"]["share"] == 1.0
    assert low["verdicts"]["good"]["lower95"] == pytest.approx(0.025**0.5)  # exact, 2 of 2
    assert (high["ended"], high["failed"], high["runs"]) == (2, 1, 2)


def test_nine_runs_that_broke_down_and_a_good_one_are_one_of_ten(begin_sweep, make_verdict):
    (group,) = groups(
        begin_sweep(
            {f"seed={i}": "NaN" for i in range(9)} | {"seed=9": {"verdict": make_verdict()}}
        )
    )
    assert group["solved"] == {**proportion(1, 10), "unknown": 0}
    assert group["verdicts"]["good"]["share"] == 0.1
    assert group["verdicts"]["good"]["upper95"] == proportion(1, 10)["upper95"]  # all is known
    assert group["verdicts"]["failed"]["share"] == 0.9
    assert group["frames_to_solve"]["median"] is None
    assert group["frames_to_solve"]["more_than"] == 1000  # what they had when they failed
    assert group["final_share"]["median"] == 0.0


def test_who_solved_late_is_told_from_who_never_did(begin_sweep):
    runs = {f"seed={i}": {"frames": 1000} for i in range(2)}
    (late,) = groups(begin_sweep(runs | {"seed=2": {"frames": 9000}, "seed=3": {"frames": 9000}}))
    assert (late["frames_to_solve"]["median"], late["solved"]["share"]) == (5000, 1.0)


def test_who_never_solved_is_censored(begin_sweep):
    never = {"frames": 9000, "reason": "frames"}
    runs = {f"seed={i}": {"frames": 1000} for i in range(2)}
    (found,) = groups(begin_sweep(runs | {"seed=2": never, "seed=3": never}))
    assert (found["frames_to_solve"]["median"], found["solved"]["share"]) == (None, 0.5)
    assert found["frames_to_solve"]["more_than"] == 5000


def test_what_is_certain_is_counted_beside_what_is_of_a_kind(begin_sweep, make_verdict):
    certain, not_certain = ({"verdict": make_verdict(certain=c)} for c in (True, False))
    (group,) = groups(begin_sweep({"seed=0": certain, "seed=1": not_certain}))
    good = group["verdicts"]["good"]
    assert (good["successes"], good["certain"]) == (2, 1)


def test_runs_that_are_not_judged_may_be_of_any_kind(begin_sweep, make_verdict):
    old = {"evaluation": {}}
    (group,) = groups(begin_sweep({"seed=0": {"verdict": make_verdict()}, "seed=1": old}))
    for kind, hits in {"good": 1, "poor": 0}.items():
        share = group["verdicts"][kind]
        assert share["lower95"] == proportion(hits, 2)["lower95"]
        assert share["upper95"] == proportion(hits + 1, 2)["upper95"]
    assert group["verdicts"]["failed"]["unknown"] == 0  # it did not fail
    assert group["solved"]["share"] == 1.0


def test_a_damaged_run_may_be_anything_and_an_unfinished_one_is_left_out(begin_sweep):
    sweep = begin_sweep({"seed=0": {}, "seed=1": {"frames": "many"}, "seed=2": None})
    (group,) = groups(sweep)
    assert (group["runs"], group["ended"], group["unfinished"]) == (3, 2, 1)
    assert group["solved"] == {
        **proportion(1, 2),
        "upper95": 1.0,
        "unknown": 1,
    }
    assert group["verdicts"]["failed"]["unknown"] == 1
    assert group["frames_to_solve"]["runs"] == 1
    assert json.dumps(group)
