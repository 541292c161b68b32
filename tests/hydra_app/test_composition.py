"""A command's settings, its exit status, and what becomes of a mistake in one of many runs."""

import dataclasses
import types

import pytest
from omegaconf import OmegaConf

from drone_rl.hydra_app.composition import HydraConfig, _job, conf_dir, read_settings
from drone_rl.utils.errors import InputError
from drone_rl.utils.settings import Settings


@dataclasses.dataclass(frozen=True, kw_only=True)
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
