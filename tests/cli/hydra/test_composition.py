"""A command's settings, its exit status, and what becomes of a mistake in one of many runs."""

import copy
import types
from unittest.mock import patch

import pytest
from hydra.core.config_store import ConfigStore
from omegaconf import OmegaConf

from drone_rl import define_task
from drone_rl.cli.evaluation import EvaluateCommand
from drone_rl.cli.hydra import composition
from drone_rl.cli.hydra.composition import HydraConfig, _job, read_settings
from drone_rl.cli.settings import CommandSettings
from drone_rl.cli.train import TrainCommand
from drone_rl.config import TASKS
from drone_rl.sim.tasks.task import MAKERS
from drone_rl.utils.errors import InputError


class Command(CommandSettings):
    name: str = "x"


@pytest.fixture
def job(monkeypatch, tmp_path):
    """A job that does what it is given, in a folder."""
    runtime = types.SimpleNamespace(runtime=types.SimpleNamespace(output_dir=str(tmp_path)))
    monkeypatch.setattr(HydraConfig, "get", lambda: runtime)

    def make(run):
        statuses = []
        monkeypatch.setattr(Command, "run", run)
        return _job("mine", Command, statuses), statuses

    return make


def test_a_job_gets_its_settings_and_its_folder(job, tmp_path):
    function, statuses = job(lambda settings, folder: (3, (settings.name, folder)))
    config = OmegaConf.create({"name": "zy"})
    assert function(config) == ("zy", tmp_path)
    assert statuses[-1] == 3
    assert read_settings(Command, config) == Command(name="zy")


def test_a_mistake_in_one_run_leaves_the_others_alone(job, capsys):
    def run(settings, folder):
        raise InputError("seed=-1 is out of range")

    function, statuses = job(run)
    assert function(OmegaConf.create({})) is None
    assert statuses == [2]
    assert capsys.readouterr().err == "error: seed=-1 is out of range\n"


def test_a_signal_ends_a_whole_sweep(job):
    function, _ = job(lambda *_: (143, None))
    with pytest.raises(SystemExit) as stop:
        function(OmegaConf.create({}))
    assert stop.value.code == 143


def test_a_command_gets_its_settings_and_status_for_each_run(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("HYDRA_FULL_ERROR", "1")  # as `guarded` does
    runs = []

    def run(settings, folder):
        runs.append((settings.seed, folder.relative_to(tmp_path).as_posix()))
        return 10 + settings.seed, None

    monkeypatch.setattr(EvaluateCommand, "run", run)
    words = [
        "seed=1,2",
        "-m",
        "device=cpu",
        "hydra.sweep.dir=x",
        "hydra.sweep.subdir=${hydra.job.num}",
    ]
    assert composition.run_command("evaluate", EvaluateCommand, words) == 12
    assert runs == [(1, "x/0"), (2, "x/1")]
    with pytest.raises(InputError, match="runs 0 and 1 have the same folder"):
        composition.run_command("evaluate", EvaluateCommand, [*words[:-1], "hydra.sweep.subdir=y"])
    assert len(runs) == 2 and not (tmp_path / "x" / "y").exists()


def test_a_term_that_a_task_does_not_list_can_be_set(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("HYDRA_FULL_ERROR", "1")
    ball = {"shape": "ball", "role": "goal"}
    terms = {"reward": {"progress": 1.0}, "success": ["all_goals"]}
    given = []

    def run(settings, folder):
        given.append(settings.task)
        return 0, None

    monkeypatch.setattr(TrainCommand, "run", run)
    store = ConfigStore.instance()
    monkeypatch.setattr(store, "repo", copy.deepcopy(store.repo))
    with patch.dict(TASKS), patch.dict(MAKERS):
        define_task("test_composed", objects={"ball": ball}, **terms)
        words = ["task=test_composed", "task.reward.time.weight=-0.5"]
        composition.run_command("train", TrainCommand, words)
        assert {n: t.weight for n, t in given[0].reward.items()} == {"progress": 1.0, "time": -0.5}
