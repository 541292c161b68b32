"""Trainings and sweeps judge last policies in worlds to choose by, and keep the whole verdict."""

import json
import shutil

import pytest

from drone_rl.api.choosing import judge_run, judge_to_choose
from drone_rl.api.policy import Policy
from drone_rl.sweeps import Run, Sweep
from drone_rl.utils.errors import InputError
from drone_rl.utils.seeding import Stream
from tests.cli.test_commands import error_line, in_process, run  # noqa: F401


@pytest.fixture
def trained(run, tmp_path):  # noqa: F811
    """A copy of a finished training that was not judged."""
    return shutil.copytree(run, tmp_path / "sweep" / "0")


@pytest.fixture
def sweep(trained):
    """A sweep of the training and of one that never began."""
    folder = trained.parent
    runs = [Run(i, (f"seed={i}",), folder / str(i)) for i in range(2)]
    made = Sweep(folder, "drone-rl train -m", {}, runs)
    made.save()
    return made


def test_the_worlds_are_those_to_choose_by(trained, monkeypatch):
    asked = {}

    def note(self, num_envs, **kwargs):
        asked.update(kwargs, num_envs=num_envs)
        raise InputError("enough")

    monkeypatch.setattr(Policy, "make_env", note)
    with pytest.raises(InputError, match="enough"):
        judge_to_choose(trained / "checkpoints" / "last.pt", 5, "cpu")
    assert asked == {"stream": Stream.CHOICE, "device": "cpu", "num_envs": 5}


def test_a_run_keeps_its_verdict_beside_its_result(trained):
    before = json.loads((trained / "result.json").read_text())
    assert "verdict" not in before
    verdict = judge_run(trained, 12, "cpu")
    after = json.loads((trained / "result.json").read_text())
    assert after == {**before, "verdict": json.loads(json.dumps(verdict))}
    assert verdict["greedy"]["episodes"] == verdict["sampled"]["episodes"] == 12
    assert judge_run(trained, 12, "cpu") == verdict  # once more, to the last bit


def test_a_checkpoint_that_is_not_that_of_the_result_is_refused(trained):
    result = json.loads((trained / "result.json").read_text())
    (trained / "result.json").write_text(json.dumps({**result, "frames": 7}))
    with pytest.raises(InputError, match=r"frame 7; go on with"):
        judge_run(trained, 4, "cpu")
    (trained / "result.json").unlink()
    with pytest.raises(InputError, match=r"no result\.json"):
        judge_run(trained, 4, "cpu")


def test_a_sweep_that_was_not_judged_can_be(sweep, in_process):  # noqa: F811
    done = in_process("sweep-report", sweep.folder, "judge=true", "episodes=8")
    assert done.returncode == 0, done.stderr
    assert "Verdicts are on the last policies of 1 run, by 8 greedy episodes" in done.stdout
    assert "1 run not ended yet" in done.stdout
    summary = json.loads((sweep.folder / "summary.json").read_text())
    assert (summary["judged"], summary["best"]["run"]) == (1, 0)


def test_a_run_that_can_not_be_judged_leaves_the_others_alone(sweep, in_process):  # noqa: F811
    (sweep.folder / "0" / "checkpoints" / "last.pt").write_bytes(b"rubbish")
    done = in_process("sweep-report", sweep.folder, "judge=true", "episodes=8")
    assert done.returncode == 0, done.stderr
    assert "1 run finished and not judged" in done.stdout


def test_no_episodes_are_a_mistake(sweep, in_process):  # noqa: F811
    line = error_line(in_process("sweep-report", sweep.folder, "judge=true", "episodes=0"))
    assert "episodes=0" in line


def test_a_report_alone_judges_nothing(sweep, in_process):  # noqa: F811
    done = in_process("sweep-report", sweep.folder)
    assert done.returncode == 0, done.stderr
    assert "verdict" not in json.loads((sweep.folder / "0" / "result.json").read_text())
