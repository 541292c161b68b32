"""What the files of a run tell, and what they can't."""

import json

import pytest

from drone_rl.sweeps.rows import read_rows


def rewrite(sweep, number, **changed):
    """Changes a run's result; what is None goes."""
    path = sweep.folder / str(number) / "result.json"
    result = {**json.loads(path.read_text()), **changed}
    path.write_text(json.dumps({k: v for k, v in result.items() if v is not None}))


def test_rows_tell_what_became_of_every_run(sweep):
    rows = read_rows(sweep)
    assert [row.state for row in rows] == ["finished", "finished", "finished", "failed"]
    assert rows[0].choice == {"optimizer.lr": "1e-3", "seed": "0"}
    assert [row.kind for row in rows] == ["good", "good", "one-sided", None]
    assert [row.is_certain for row in rows] == [True, True, False, False]
    assert [row.is_solved for row in rows] == [True, True, False, False]
    assert rows[0].curve[1].tolist() == pytest.approx([0.1, 0.5])
    assert [row.lean for row in rows] == [0.0, 0.0, 1.0, None]  # all of the right, none of the left
    assert [row.entropy for row in rows] == [0.75] * 4  # of both updates


def test_a_failed_run_keeps_what_it_had_and_learned_nothing(sweep):
    failed = read_rows(sweep)[3]
    assert (failed.frames, failed.seconds) == (1000, 2)
    assert len(failed.curve[0]) == 0
    assert failed.final_share == 0.0
    assert failed.error == "<b>NaN</b>"
    (sweep.folder / "3" / "metrics.csv").unlink()  # it may have failed before the first update
    assert read_rows(sweep)[3].frames == 0


def test_no_cubes_on_a_side_is_no_share_of_zero(sweep, make_verdict):
    rewrite(sweep, 0, verdict=make_verdict(left=None))
    row = read_rows(sweep)[0]
    assert row.lean is None
    assert row.plain()["left"] == "not offered"
    assert row.plain()["right"] == 1.0
    assert read_rows(sweep)[3].plain()["left"] is None  # not judged at all


@pytest.mark.parametrize("strata", [("anywhere",), ("left", "right")])
def test_runs_of_a_task_with_other_strata_are_not_damaged(sweep, make_verdict, strata):
    rewrite(sweep, 0, verdict=make_verdict(strata=strata))
    row = read_rows(sweep)[0]
    assert (row.state, row.share("all"), row.share("ahead")) == ("finished", 1.0, None)
    assert row.lean == (0.0 if "left" in strata else None)
    assert row.plain()["ahead"] == "not offered"


@pytest.mark.parametrize(
    "older",
    [{"verdict": None, "evaluation": {"mean_cubes": 3.0}}, {"verdict": {"rule": "of yore"}}],
)
def test_a_verdict_by_an_older_rule_is_said_and_not_counted(sweep, older):
    rewrite(sweep, 0, **older)
    row = read_rows(sweep)[0]
    assert row.state == "finished"
    assert row.verdict is row.kind is row.share("all") is None
    assert row.has_older_verdict
    assert row.plain()["verdict"] == "judged by an older rule: not counted"


def test_a_run_without_a_verdict_says_so(sweep):
    rewrite(sweep, 0, verdict=None)
    row = read_rows(sweep)[0]
    assert not row.has_older_verdict
    assert row.plain()["verdict"] == "not judged"


@pytest.mark.parametrize(
    "broken",
    [
        {"frames": None},
        {"largest_reward": None},
        {"seconds": "long"},
        {"running_reward": float("nan")},
        {"episodes": True},
        {"largest_reward": 0},
        {"verdict": "good"},
        {"verdict": []},
    ],
)
def test_an_incomplete_result_is_damaged(sweep, broken):
    rewrite(sweep, 0, **broken)
    rows = read_rows(sweep)
    assert [row.state for row in rows] == ["damaged", "finished", "finished", "failed"]
    assert "can't be read" in rows[0].error


@pytest.mark.parametrize(
    "broken",
    [
        {"kind": "splendid"},
        {"certain": "yes"},
        {"greedy": {}},
        {"greedy": {"shares": {"left": {"mean": "much"}}}},
    ],
)
def test_an_incomplete_verdict_is_damaged(sweep, make_verdict, broken):
    rewrite(sweep, 0, verdict={**make_verdict(), **broken})
    assert read_rows(sweep)[0].state == "damaged"


@pytest.mark.parametrize(
    "lie",
    [
        {"frames": -1},
        {"frames": 1.5},
        {"largest_reward": 1e308},
        {"seconds": -1.0},
    ],
)
def test_a_result_out_of_range_is_damaged(sweep, lie):
    rewrite(sweep, 0, **lie)
    assert read_rows(sweep)[0].state == "damaged"


def test_a_perfect_reward_is_not_out_of_range(sweep):
    rewrite(sweep, 0, running_reward=3.0)
    assert read_rows(sweep)[0].state == "finished"


@pytest.mark.parametrize(
    "line", ["400,3,1.5,0.5", "1500,3,nan,0.5", "inf,3,1.5,0.5", "1e300,3,1,1"]
)
def test_metrics_out_of_range_are_damage(sweep, line):
    with (sweep.folder / "0" / "metrics.csv").open("a") as file:
        file.write(f"3,{line}\n")
    assert read_rows(sweep)[0].state == "damaged"


def test_a_run_that_failed_with_no_number_keeps_what_it_had(sweep):
    with (sweep.folder / "3" / "metrics.csv").open("a") as file:
        file.write("3,1500,3,nan,nan\n")
    failed = read_rows(sweep)[3]
    assert (failed.frames, failed.seconds, failed.entropy) == (1500, 3, None)


def test_a_run_that_failed_before_its_first_update_has_nothing(sweep):
    metrics = sweep.folder / "3" / "metrics.csv"
    metrics.write_text(metrics.read_text().splitlines()[0] + "\n")
    failed = read_rows(sweep)[3]
    assert (failed.state, failed.frames, failed.seconds) == ("failed", 0, 0)


def test_a_long_run_is_no_damage(sweep):
    names = ["frames", "train/running_reward", "seconds", "loss/entropy"]
    header = ",".join([*names, *(f"other_{number}" for number in range(15))])
    row = ",".join(["9", "1.5", "9", "0.25", *["1.23456"] * 15])
    (sweep.folder / "0" / "metrics.csv").write_text("\n".join([header, *[row] * 120_000]))
    long = read_rows(sweep)[0]
    assert (long.state, len(long.curve[0]), long.entropy) == ("finished", 120_000, 0.25)


def test_a_cell_beyond_the_header_is_in_no_column(sweep):
    (sweep.folder / "0" / "metrics.csv").write_text(
        "frames,train/running_reward,seconds\n900,1.5,9,0.25\n"
    )
    assert read_rows(sweep)[0].entropy is None


@pytest.mark.parametrize("header", ["frames,seconds", "train/running_reward", ",,,"])
def test_a_table_without_a_required_column_is_damaged_even_without_rows(sweep, header):
    (sweep.folder / "0" / "metrics.csv").write_text(header + "\n")
    assert read_rows(sweep)[0].state == "damaged"


def test_unreadable_metrics_are_damage_and_an_unreadable_result_must_be_made_again(sweep):
    (sweep.folder / "0" / "metrics.csv").write_text("frames\nrubbish\n")
    (sweep.folder / "1" / "result.json").write_text("{")
    rows = read_rows(sweep)
    assert [row.state for row in rows] == ["damaged", "unfinished", "finished", "failed"]
