"""Rows, groups, verdicts and pages of a sweep that was made by hand."""

import csv
import json

import pytest
from matplotlib.figure import Figure

from drone_rl.sweeps import figures
from drone_rl.sweeps.page import write_picture, write_report
from drone_rl.sweeps.summary import best_row, make_groups, read_rows
from drone_rl.utils.errors import InputError


def test_rows_tell_what_became_of_every_run(sweep):
    rows = read_rows(sweep)
    assert [row.state for row in rows] == ["finished", "finished", "finished", "failed"]
    assert rows[0].choice == {"optimiser.lr": "1e-3", "seed": "0"}
    assert [row.verdict for row in rows] == ["good", "good", "one-sided", None]
    assert rows[0].curve[1].tolist() == pytest.approx([0.1, 0.5])
    assert [row.lean for row in rows] == [0.0, 0.0, 1.0, None]  # all of the right, none of the left
    assert [row.entropy for row in rows] == [0.75, 0.75, 0.75, None]  # of both updates
    assert best_row(rows).run.number == 0


def test_groups_are_runs_that_differ_in_their_seed_alone(sweep):
    low, high = (group.plain() for group in make_groups(read_rows(sweep)))
    assert low["optimiser.lr"] == "1e-3"
    assert low["solved"]["successes"] == 2
    assert low["median_frames_to_solve"] == 1500
    assert low["verdicts"]["good"]["share"] == 1.0
    assert low["verdicts"]["good"]["lower95"] == pytest.approx(0.025**0.5)  # exact, 2 of 2
    assert (high["finished"], high["runs"]) == (1, 2)


def test_report_is_whole_and_escapes_what_it_shows(sweep):
    page = write_report(sweep).read_text()
    assert "<b>NaN</b>" not in page
    assert "&lt;b&gt;NaN" in page
    assert page.count("data:image/png;base64,") == 10  # five figures, light and dark
    assert "drone-rl train optimiser.lr=1e-3 seed=0" in page
    assert 'href="2/"' in page
    assert "http:" not in page
    assert "https:" not in page
    summary = json.loads((sweep.folder / "summary.json").read_text())
    assert (summary["finished"], summary["failed"], summary["best"]["run"]) == (3, 1, 0)
    with (sweep.folder / "summary.csv").open(newline="") as file:
        assert [row["verdict"] for row in csv.DictReader(file)] == ["good", "good", "one-sided", ""]


def test_runs_that_were_solved_are_seen_beside_a_panel_without_any(sweep):
    solved, unsolved = make_groups(read_rows(sweep))
    layout = figures.Layout("optimiser.lr", {"first": [unsolved], "second": [solved]})
    first, second = Figure().subplots(1, 2, sharey=True)
    figures._costs(first, layout, [unsolved])
    figures._costs(second, layout, [solved])
    assert second.get_ylim() == (0, 1.2 * 2000)
    assert [list(line.get_ydata()) for line in second.lines] == [[1000, 2000]]


def test_a_corrupt_run_leaves_the_others_unharmed(sweep):
    (sweep.folder / "0" / "metrics.csv").write_text("frames\nrubbish\n")
    (sweep.folder / "1" / "result.json").write_text("{")
    rows = read_rows(sweep)
    assert [row.state for row in rows] == ["damaged", "unfinished", "finished", "failed"]
    assert "can't be read" in rows[0].error
    write_report(sweep)


def test_a_sweep_with_nothing_finished_has_a_report_and_no_picture(sweep, tmp_path):
    picture = tmp_path / "new" / "folder" / "picture.png"
    write_picture(sweep, picture)
    assert picture.read_bytes().startswith(b"\x89PNG")
    for path in sweep.folder.glob("*/result.json"):
        path.unlink()
    assert "No run has finished yet" in write_report(sweep).read_text()
    with pytest.raises(InputError, match="evaluate_after"):
        write_picture(sweep, picture)
