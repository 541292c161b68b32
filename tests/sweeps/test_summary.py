"""The best run, and the commands that a reader is sent to."""

import csv
import io

from drone_rl.sweeps.rows import read_rows
from drone_rl.sweeps.summary import best_rows, summarise_sweep, to_csv


def test_five_cubes_are_no_merit(begin_sweep, make_verdict):
    """A share of 0.7 of five cubes is more cubes than all of three, but not better."""
    many = {"largest_reward": 5, "running_reward": 3.5, "verdict": make_verdict("poor", whole=0.7)}
    few = {"largest_reward": 2, "running_reward": 1.8, "verdict": make_verdict(whole=0.95)}
    rows = read_rows(begin_sweep({"task.num_cubes=5": many, "task.num_cubes=1": few}))
    assert [row.error for row in rows] == [None, None]
    assert [row.run.number for row in best_rows(rows)] == [1, 0]


def test_of_equals_the_sooner_trained_is_named_and_the_others_counted(begin_sweep, make_verdict):
    verdict = {"verdict": make_verdict()}
    sweep = begin_sweep({"seed=0": {**verdict, "frames": 2000}, "seed=1": verdict, "seed=2": {}})
    best = summarise_sweep(sweep, read_rows(sweep))["best"]
    assert (best["run"], best["equals"]) == (1, 1)


def test_no_run_is_best_without_a_verdict(begin_sweep):
    sweep = begin_sweep({"seed=0": {}, "seed=1": {"evaluation": {"mean_cubes": 3.0}}})
    found = summarise_sweep(sweep, read_rows(sweep))
    assert found["best"] is None
    assert (found["judged_by_older_rule"], found["never_judged"]) == (1, 1)
    assert "none" not in found["sentences"]["verdicts.older_rule"]


def test_runs_that_only_clone_are_no_copies(begin_sweep):
    none = {"reason": "frames", "frames": 0, "episodes": 0, "seconds": 0.0, "running_reward": 0.0}
    sweep = begin_sweep({"seed=0": none, "seed=1": none})
    assert "runs.copies" not in summarise_sweep(sweep, read_rows(sweep))["sentences"]


def test_it_names_the_commands_to_report_and_to_judge(sweep, monkeypatch):
    monkeypatch.chdir(sweep.folder.parent)
    found = summarise_sweep(sweep, read_rows(sweep))
    name = sweep.folder.name
    assert found["best"]["report_command"] == f"drone-rl verdict policy={name}/0"
    assert found["judge_command"] == f"drone-rl sweep-report folder={name} judge=true"
    assert found["best"]["command"] == "drone-rl train optimizer.lr=1e-3 seed=0 logger=csv"


def test_all_is_counted(sweep):
    found = summarise_sweep(sweep, read_rows(sweep))
    states = ("finished", "failed", "damaged", "unfinished", "judged", "certain")
    assert [found[state] for state in states] == [3, 1, 0, 0, 3, 2]
    assert found["episodes"] == [200]
    assert found["groups"][1]["sentences"]["group.solved"] == "solved 0 of 2"


def test_the_table_has_a_line_a_run(sweep):
    table = list(csv.DictReader(io.StringIO(to_csv(read_rows(sweep)))))
    assert [row["verdict"] for row in table] == ["good", "good", "one-sided (right)", ""]
    assert [row["certain"] for row in table] == ["True", "True", "False", ""]
    assert table[2]["left"] == "0.0"
    assert to_csv([]).strip() == ""


def test_copies_of_a_run_are_counted_and_named(begin_sweep):
    others = {"seed=0": {"seconds": 1.25}, "seed=1": {"seconds": 1.5}, "seed=2": {"seconds": 1.25}}
    sweep = begin_sweep(others)
    found = summarise_sweep(sweep, read_rows(sweep))
    assert found["copies"] == 1
    assert found["sentences"]["runs.copies"].startswith("1 run with exactly the figures of another")


def test_different_seconds_are_no_copies(begin_sweep):
    sweep = begin_sweep({"seed=0": {"seconds": 1.25}, "seed=1": {"seconds": 1.5}})
    assert "runs.copies" not in summarise_sweep(sweep, read_rows(sweep))["sentences"]
