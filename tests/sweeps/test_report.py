"""Page, chart, terminal lines and verdicts of a sweep."""

import json
import os
import shutil
import subprocess
import sys

import pytest

import drone_rl
from drone_rl.sweeps.manifest import Run, Sweep
from drone_rl.sweeps.report import (
    _median,
    find_sweep,
    judge_run,
    terminal_lines,
    text_of,
    write_picture,
    write_sweep_report,
)
from drone_rl.sweeps.summary import median_of_runs
from drone_rl.trust.results import Verdict
from drone_rl.utils.errors import InputError
from drone_rl.utils.intervals import proportion
from drone_rl.utils.progress import silent
from drone_rl.utils.run_result import RunResult
from drone_rl.utils.seeding import RootSeed
from tests.training.test_train import TINY


def test_report_escapes_what_it_shows(sweep):
    page = write_sweep_report(sweep)[0].read_text()
    assert "<b>NaN</b>" not in page
    assert "&lt;b&gt;NaN" in page
    assert "further panels" not in page
    assert page.count("data:image/png;base64,") == 2
    assert "1 of 2 (1.3% to 98.7%)" in page  # failed at the high rate
    assert "drone-rl train optimizer.lr=1e-3 seed=0" in page
    assert 'href="./2/"' in page
    assert "http:" not in page
    assert "https:" not in page
    summary = json.loads((sweep.folder / "summary.json").read_text())
    assert (summary["finished"], summary["failed"], summary["best"]["run"]) == (3, 1, 0)
    assert (sweep.folder / "summary.csv").read_text().count("\n") == 5
    assert summary["groups"][0]["settings"] == {"optimizer.lr": "1e-3"}


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
    assert "Learning curves (without 2 further panels)" in page


def test_cells():
    assert _median(median_of_runs([1.0, 2.0])) == "1.5"
    assert _median(median_of_runs([123456.0])) == "123,456"
    assert _median(median_of_runs([float("inf")], [500.0])) == ">500"
    six = [1.0, 2, 3, 4, 5, float("inf")]
    assert _median(median_of_runs(six, [1.0, 2, 3, 4, 5, 9])) == "3.5 [1, more]"
    assert _median(median_of_runs([])) == ""


def begun(folder):
    folder.mkdir(parents=True)
    runs = (Run(0, ("seed=0",), folder / "0"),)
    Sweep(folder=folder, command="drone-rl train -m seed=0", settings={}, runs=runs).save()
    return folder


def test_the_latest_is_the_newest(tmp_path):
    sweeps = [begun(tmp_path / "train" / "multiruns" / name) for name in ("b", "a")]
    for number, sweep in enumerate(sweeps):
        os.utime(sweep / "sweep.json", (number, number))
    assert find_sweep("latest", tmp_path).folder == sweeps[1]
    assert find_sweep(sweeps[0]).folder == sweeps[0]


def test_no_sweep(tmp_path):
    with pytest.raises(InputError, match="drone-rl train -m first"):
        find_sweep("latest", tmp_path)


def test_terminal_lines(sweep):
    lines = terminal_lines(write_sweep_report(sweep)[1]).splitlines()
    assert lines[0].startswith("4 runs: 3 finished, 1 failed, 0 unfinished. Failed")
    low, high = (line.split(maxsplit=1) for line in lines[2:4])
    assert low == ["optimizer.lr=1e-3", "solved 2 of 2; verdicts: good 2"]
    assert high[1] == "solved 0 of 2; verdicts: one-sided 1, failed 1"
    assert lines[4] == "run 3 failed: <b>NaN</b>"
    assert lines[5].startswith(
        "best run: Run 0: good, which reaches 100% of its goals in 200 episodes"
    )
    assert lines[6] == "to repeat it: drone-rl train optimizer.lr=1e-3 seed=0 logger=csv"


@pytest.fixture
def six(begin_sweep, make_verdict):
    """Six good runs of one setting."""
    runs = {f"seed={i}": {"verdict": make_verdict()} for i in range(6)}
    return write_sweep_report(begin_sweep(runs))[1]


@pytest.mark.parametrize(
    ("part", "text", "change"),
    [
        ("runs", "count as not solved", {"failed": 1}),
        ("runs", "1 of 1 settings have fewer than 6", {"groups": {"solved": proportion(1, 5)}}),
        ("verdicts", "2 of 6 verdicts are not certain", {"certain": 4}),
        ("verdicts", "without a verdict by the present rule", {"judged": 5}),
        ("best", "No run has been judged", {"best": None}),
    ],
)
def test_what_makes_a_sentence(six, part, text, change):
    assert text not in text_of(six, part) and text in text_of(changed(six, **change), part)


@pytest.mark.parametrize(
    ("part", "text", "change"),
    [
        ("verdicts", "Verdicts are on the last policies", {"judged": 0}),
        ("best", "reaches 100% of its goals", {"best": None}),
        ("best", "optimistic", {"judged": 1}),
        ("settings", "exact 95% intervals", {"finished": 0}),
    ],
)
def test_what_takes_a_sentence_away(six, part, text, change):
    assert text in text_of(six, part) and text not in text_of(changed(six, **change), part)


def changed(summary, **change):
    """Return a summary with other values, of its groups too."""
    groups = change.pop("groups", {})
    every = tuple(group.replace(**groups) for group in summary.groups)
    return summary.replace(groups=every, **change)


def test_a_report_and_the_plugins_of_hydra_need_no_torch():
    modules = "drone_rl.sweeps.report, drone_rl.cli.train, hydra_plugins.drone_rl"
    code = f"import sys, {modules}; assert 'torch' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True)


@pytest.fixture(scope="module")
def training(tmp_path_factory):
    return drone_rl.train(TINY, folder=tmp_path_factory.mktemp("run"), progress=silent).folder


@pytest.fixture
def trained(training, tmp_path):
    """The folder of a training that was not judged."""
    return shutil.copytree(training, tmp_path / "run")


def test_a_run_keeps_its_verdict_beside_its_result(trained):
    before = RunResult.of(trained)
    assert before.verdict is None
    seed = RootSeed(4, is_fixed=False)
    verdict = judge_run(trained, 12, "cpu", seed=seed)
    assert (verdict.seed, verdict.seed_is_fixed) == (4, False)
    after = RunResult.of(trained)
    assert Verdict.read(dict(after.verdict)) == verdict
    assert after.replace(verdict=None) == before
    assert verdict.greedy.episodes == verdict.sampled.episodes == 12
    assert judge_run(trained, 12, "cpu", seed=seed) == verdict  # once more, to the last bit


def test_a_checkpoint_that_is_not_that_of_the_result_is_refused(trained):
    result = json.loads((trained / "result.json").read_text())
    (trained / "result.json").write_text(json.dumps({**result, "frames": 7}))
    with pytest.raises(InputError, match=r"frame 7; resume with"):
        judge_run(trained, 4, "cpu")
    (trained / "result.json").write_text(json.dumps({**result, "frames": 10**6}))
    with pytest.raises(InputError, match=r"frame 1000000; resume with"):
        judge_run(trained, 4, "cpu")
    (trained / "result.json").unlink()
    with pytest.raises(InputError, match=r"no result\.json"):
        judge_run(trained, 4, "cpu")
