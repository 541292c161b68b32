"""One row for each run, read from its files."""

import json

import pytest

from drone_rl.sweeps.rows import read_rows


def rewrite(sweep, number, **changed):
    """Changes a run's result; a value of None removes a name."""
    path = sweep.folder / str(number) / "result.json"
    result = {**json.loads(path.read_text()), **changed}
    path.write_text(json.dumps({k: v for k, v in result.items() if v is not None}))


def test_rows_of_finished_and_failed_runs(sweep):
    rows = read_rows(sweep)
    assert [row.state for row in rows] == ["finished", "finished", "finished", "failed"]
    assert rows[0].settings == {"optimizer.lr": "1e-3", "seed": "0"}
    assert [row.kind for row in rows] == ["good", "good", "one-sided", None]
    assert [row.certain for row in rows] == [True, True, False, None]
    assert [row.is_solved for row in rows] == [True, True, False, False]
    assert rows[0].curve[1].tolist() == pytest.approx([0.1, 0.5])
    assert [row.lean for row in rows] == [0.0, 0.0, 1.0, None]  # all of the right, none of the left
    assert [row.entropy for row in rows] == [0.75] * 4  # of both updates


def test_a_failed_run_keeps_its_frames_and_learned_nothing(sweep):
    failed = read_rows(sweep)[3]
    assert (failed.frames, failed.seconds, failed.error) == (1000, 2, "<b>NaN</b>")
    assert (len(failed.curve[0]), failed.final_share) == (0, 0.0)
    metrics = sweep.folder / "3" / "metrics.csv"
    with metrics.open("a") as file:
        file.write("3,1500,3,nan,nan\n")
    failed = read_rows(sweep)[3]
    assert (failed.frames, failed.seconds, failed.entropy) == (1500, 3, None)
    metrics.write_text(metrics.read_text().splitlines()[0] + "\n")
    assert read_rows(sweep)[3].frames == 0
    metrics.unlink()  # it failed before the first update
    assert read_rows(sweep)[3].frames == 0


def test_a_side_without_goals_has_no_share(sweep, make_verdict):
    rewrite(sweep, 0, verdict=make_verdict(left=None))
    row = read_rows(sweep)[0]
    assert row.lean is None
    assert (row.left, row.right) == (None, 1.0)


@pytest.mark.parametrize("strata", [("anywhere",), ("left", "right")])
def test_a_task_with_other_strata(sweep, make_verdict, strata):
    rewrite(sweep, 0, verdict=make_verdict(strata=strata))
    row = read_rows(sweep)[0]
    assert (row.state, row.share, row.ahead) == ("finished", 1.0, None)
    assert row.lean == (0.0 if "left" in strata else None)


@pytest.mark.parametrize("verdict", [{"rule": "another"}, None])
def test_runs_without_a_verdict_by_the_current_rule(sweep, verdict):
    rewrite(sweep, 0, verdict=verdict)
    row = read_rows(sweep)[0]
    assert row.state == "finished"
    assert row.judged is row.kind is row.verdict is row.share is None


@pytest.mark.parametrize(
    "broken",
    [
        {"frames": -1},
        {"running_reward": float("nan")},
    ],
)
def test_a_damaged_result(sweep, broken):
    rewrite(sweep, 0, **broken)
    rows = read_rows(sweep)
    assert [row.state for row in rows] == ["failed", "finished", "finished", "failed"]
    assert "can't be read" in rows[0].error


def test_a_damaged_verdict(sweep, make_verdict):
    rewrite(sweep, 0, verdict={**make_verdict(), "kind": "splendid"})
    assert read_rows(sweep)[0].state == "failed"


@pytest.mark.parametrize(
    "text", ["frames,seconds\n", "frames\nrubbish\n", "frames,train/running_reward\n1,much\n"]
)
def test_damaged_metrics(sweep, text):
    (sweep.folder / "0" / "metrics.csv").write_text(text)
    (sweep.folder / "1" / "result.json").write_text("{")
    rows = read_rows(sweep)
    assert [row.state for row in rows] == ["failed", "failed", "finished", "failed"]
