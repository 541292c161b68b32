"""A command's settings, its exit status, and what becomes of a mistake in one of many runs."""

import types

import pytest
from omegaconf import OmegaConf

from drone_rl.cli import train
from drone_rl.cli.hydra import composition
from drone_rl.cli.hydra.composition import (
    Hydra,
    HydraConfig,
    _composed_once,
    _job,
    conf_dir,
    read_settings,
)
from drone_rl.utils.errors import InputError
from drone_rl.utils.settings import Settings


class Command(Settings):
    name: str = "x"


@pytest.fixture
def job(monkeypatch, tmp_path):
    """A job that does what it is given, in a folder."""
    runtime = types.SimpleNamespace(runtime=types.SimpleNamespace(output_dir=str(tmp_path)))
    monkeypatch.setattr(HydraConfig, "get", lambda: runtime)

    def make(run):
        statuses = []
        module = types.SimpleNamespace(__name__="mine", Command=Command, run=run)
        return _job(module, statuses), statuses

    return make


def test_the_configuration_is_there():
    assert (conf_dir() / "train.yaml").is_file()


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
    ("overrides", "is_spared"),
    [
        ([], True),
        (["task.num_cubes=2", "seed=1", "hydra.run.dir=here"], True),
        (["-m", "seed=1,2"], False),
        (["--multirun", "seed=1,2"], False),
        (["hydra.mode=MULTIRUN"], False),
        (["sweep=seeds"], False),
        (["experiment=mine"], False),
        (["+more=seeds"], False),
    ],
)
def test_hydra_looks_for_a_mode_where_one_may_be(overrides, is_spared):
    asked = Hydra.get_mode
    with _composed_once("train", overrides):
        assert (Hydra.get_mode is not asked) is is_spared
    assert Hydra.get_mode is asked


@pytest.mark.parametrize("text", ["sweep: seeds", "hydra:\n  mode: MULTIRUN"])
def test_hydra_looks_for_a_mode_where_the_file_has_one(text, monkeypatch, tmp_path):
    (tmp_path / "mine.yaml").write_text(text)
    monkeypatch.setattr(composition, "conf_dir", lambda: tmp_path)
    asked = Hydra.get_mode
    with _composed_once("mine", []):
        assert Hydra.get_mode is asked


def test_hydra_looks_again_after_a_mistake():
    asked = Hydra.get_mode
    with pytest.raises(KeyError), _composed_once("train", []):
        raise KeyError
    assert Hydra.get_mode is asked


def test_settings_are_composed_once(monkeypatch, tmp_path):
    composed, compose = [], Hydra.compose_config

    def count(self, *args, **kwargs):
        composed.append(kwargs["run_mode"].name)
        return compose(self, *args, **kwargs)

    monkeypatch.setattr(Hydra, "compose_config", count)
    monkeypatch.chdir(tmp_path)
    done = []

    def run(settings, folder):
        done.append(settings.seed)
        return 0, None

    monkeypatch.setattr(train, "run", run)
    words = [f"hydra.run.dir={tmp_path}"]
    assert composition.run_command("train", train, ["seed=3", *words]) == 0
    assert (composed, done) == (["RUN"], [3])
    assert composition.run_command("train", train, ["seed=4", *words, "hydra.mode=RUN"]) == 0
    assert (composed[1:], done) == (["MULTIRUN", "RUN"], [3, 4])
