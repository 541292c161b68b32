"""A command's settings, its exit status, and what becomes of a mistake in one of many runs."""

import types

import pytest
from omegaconf import OmegaConf

from drone_rl.cli.hydra import composition
from drone_rl.cli.hydra.composition import (
    Hydra,
    HydraConfig,
    _job,
    _may_be_multirun,
    read_settings,
)
from drone_rl.cli.settings import CommandSettings
from drone_rl.cli.train import TrainCommand
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
    done, statuses = job(lambda settings, folder: (3, (settings.name, folder)))
    config = OmegaConf.create({"name": "zy"})
    assert done(config) == ("zy", tmp_path)
    assert statuses[-1] == 3
    assert read_settings(Command, config) == Command(name="zy")


def test_a_mistake_in_one_run_leaves_the_others_alone(job, capsys):
    def run(settings, folder):
        raise InputError("seed=-1 is out of range")

    done, statuses = job(run)
    assert done(OmegaConf.create({})) is None
    assert statuses == [2]
    assert capsys.readouterr().err == "error: seed=-1 is out of range\n"


def test_a_signal_ends_a_whole_sweep(job):
    done, _ = job(lambda *_: (143, None))
    with pytest.raises(SystemExit) as stop:
        done(OmegaConf.create({}))
    assert stop.value.code == 143


@pytest.mark.parametrize(
    ("overrides", "may_be"),
    [
        ([], False),
        (["task.num_cubes=2", "seed=1", "hydra.run.dir=here"], False),
        (["-m", "seed=1,2"], True),
        (["--multirun", "seed=1,2"], True),
        (["hydra.mode=MULTIRUN"], True),
        (["sweep=seeds"], True),
        (["experiment=mine"], True),
        (["+more=seeds"], True),
    ],
)
def test_the_command_line_may_start_many_runs(overrides, may_be):
    assert _may_be_multirun("train", overrides) is may_be


@pytest.mark.parametrize("text", ["sweep: seeds", "hydra:\n  mode: MULTIRUN"])
def test_a_file_may_start_many_runs(text, monkeypatch, tmp_path):
    (tmp_path / "mine.yaml").write_text(text)
    monkeypatch.setattr(composition, "conf_dir", lambda: tmp_path)
    assert _may_be_multirun("mine", [])


def test_settings_are_composed_once(monkeypatch, tmp_path):
    composed, compose = [], Hydra.compose_config

    def count(self, *args, **kwargs):
        composed.append(kwargs["run_mode"].name)
        return compose(self, *args, **kwargs)

    monkeypatch.setattr(Hydra, "compose_config", count)
    monkeypatch.chdir(tmp_path)
    done, get_mode = [], Hydra.get_mode

    def run(settings, folder):
        done.append((settings.seed, folder))
        return 3, None

    monkeypatch.setattr(TrainCommand, "run", run)
    overrides = ["seed=3", f"hydra.run.dir={tmp_path}"]
    assert composition.run_command("train", TrainCommand, overrides) == 3
    assert (composed, done) == (["RUN"], [(3, tmp_path)])
    assert Hydra.get_mode is get_mode
    assert composition.run_command("train", TrainCommand, [*overrides, "hydra.mode=RUN"]) == 3
    assert composed[1:] == ["MULTIRUN", "RUN"]
