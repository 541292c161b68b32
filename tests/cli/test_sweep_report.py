"""Reports on sweeps, whose runs can be judged again."""

import json
import shutil

import pytest

from drone_rl.sweeps.manifest import Run, Sweep


@pytest.fixture
def trained(run, tmp_path):
    """A copy of a finished training that was not judged."""
    return shutil.copytree(run, tmp_path / "sweep" / "0")


@pytest.fixture
def sweep(trained):
    """A sweep of the training and of one that never began."""
    folder = trained.parent
    runs = [Run(i, (f"seed={i}",), folder / str(i)) for i in range(2)]
    made = Sweep(folder=folder, command="drone-rl train -m", settings={}, runs=tuple(runs))
    made.save()
    return made


def test_judge(sweep, in_process):
    done = in_process("sweep-report", sweep.folder, "judge=true", "episodes=8")
    assert done.returncode == 0, done.stderr
    assert "Verdicts are on the last policies of 1 run, by 8 greedy episodes" in done.stdout
    assert "1 unfinished" in done.stdout
    summary = json.loads((sweep.folder / "summary.json").read_text())
    assert (summary["judged"], summary["best"]["run"]) == (1, 0)


def test_a_report_judges_nothing_by_default(sweep, in_process):
    done = in_process("sweep-report", sweep.folder)
    assert done.returncode == 0, done.stderr
    assert json.loads((sweep.folder / "0" / "result.json").read_text())["verdict"] is None
