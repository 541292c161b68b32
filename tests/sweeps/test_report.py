"""The page of a sweep, and the picture of its outcome."""

import json

import pytest

from drone_rl.sweeps.report import _code, _figure, write_picture, write_sweep_report
from drone_rl.sweeps.summary import median_of_runs, share_of_runs
from drone_rl.utils.errors import InputError


def test_report_has_every_sentence_and_escapes_what_it_shows(sweep):
    page = write_sweep_report(sweep)[0].read_text()
    assert "<b>NaN</b>" not in page
    assert "&lt;b&gt;NaN" in page
    assert "panels are shown" not in page
    assert page.count("data:image/png;base64,") == 10  # five figures, light and dark
    assert "drone-rl train optimizer.lr=1e-3 seed=0" in page
    assert 'href="./2/"' in page
    assert "http:" not in page
    assert "https:" not in page
    summary = json.loads((sweep.folder / "summary.json").read_text())
    assert (summary["finished"], summary["failed"], summary["best"]["run"]) == (3, 1, 0)
    assert (sweep.folder / "summary.csv").read_text().count("\n") == 5
    for text in summary["sentences"].values():
        assert str(_code(text)) in page or text in page


def test_a_sweep_with_nothing_finished_has_a_report_and_no_picture(sweep, tmp_path):
    picture = tmp_path / "new" / "folder" / "picture.png"
    write_picture(sweep, picture)
    assert picture.read_bytes().startswith(b"\x89PNG")
    for path in sweep.folder.glob("*/result.json"):
        path.unlink()
    assert "No run has been judged" in write_sweep_report(sweep)[0].read_text()
    with pytest.raises(InputError, match="evaluate_after"):
        write_picture(sweep, picture)


def test_a_sweep_that_has_hardly_begun_has_a_page(begin_sweep):
    page = write_sweep_report(begin_sweep({"seed=0": None, "seed=1": None}))[0].read_text()
    assert "2 unfinished" in page
    assert "<img" not in page


def test_panels_that_are_not_plotted_are_counted(begin_sweep):
    choices = [f"objective={i} optimizer.lr={lr}" for i in range(8) for lr in ("1e-3", "1e-2")]
    page = write_sweep_report(begin_sweep({choice: {} for choice in choices}))[0].read_text()
    assert page.count("Only the first 6 of 8 panels are shown.") == 2  # curves and costs


def test_cells():
    assert _figure(median_of_runs([1.0, 2.0])) == "1.5"
    assert _figure(median_of_runs([123456.0])) == "123,456"
    assert _figure(median_of_runs([float("inf")], [500.0])) == ">500"
    six = [1.0, 2, 3, 4, 5, float("inf")]
    assert _figure(median_of_runs(six, [1.0, 2, 3, 4, 5, 9])) == "3.5 [1, more]"
    assert _figure(median_of_runs([1.0, 2, 3, 4, 5, 6])) == "3.5 [1, 6]"
    assert _figure(median_of_runs([])) == _figure(None) == _figure(share_of_runs(0, 0, 0)) == ""
    assert _figure(share_of_runs(2, 0, 2)) == "2/2 [0.16, 1.00]"
    assert _figure(share_of_runs(0, 3, 3)) == "not known"  # nothing was judged
    assert _figure(share_of_runs(1, 2, 3)) == "1/1, 2 not known [0.01, 1.00]"
    assert _figure({**share_of_runs(2, 0, 2), "certain": 1}) == "2/2, 1 certain [0.16, 1.00]"


def test_a_command_stands_out_and_nothing_else_is_markup():
    assert _code("see `a <b>` & c") == "see <code>a &lt;b&gt;</code> &amp; c"
