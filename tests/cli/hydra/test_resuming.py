"""What a training's command line leaves out."""

import os
import shlex
import shutil

import pytest
import yaml
from hydra.core.override_parser.overrides_parser import OverridesParser
from omegaconf import OmegaConf

from drone_rl.cli.hydra import resuming
from drone_rl.cli.hydra.resuming import (
    check_folder,
    complete,
    note_settings,
    resume_command,
)
from drone_rl.utils.errors import InputError
from drone_rl.utils.overrides import read_overrides


@pytest.fixture
def run(tmp_path):
    """A run that was made when networks were called policies."""
    (tmp_path / "checkpoints").mkdir()
    (tmp_path / "checkpoints" / "last.pt").write_bytes(b"")
    (tmp_path / ".hydra").mkdir()
    words = ["network=mlp", "network.hidden=[8]", "seed=3"]
    (tmp_path / ".hydra" / "overrides.yaml").write_text(yaml.safe_dump(words))
    return tmp_path


def test_a_resumed_run_takes_its_recorded_settings(run):
    words = [f"resume={run}", "seed=3"]
    assert complete(words) == [
        *("network=mlp", "network.hidden=[8]"),
        *words,
        *("hydra.mode=RUN", f"hydra.run.dir='{run}'"),
        *("hydra.output_subdir=null", "++hydra.job_logging.handlers.file.delay=true"),
    ]


@pytest.mark.parametrize("again", ["network=small_cnn"])
def test_typed_settings_replace_recorded_ones(run, again):
    found = complete([f"resume={run}", again])
    assert "network=mlp" not in found
    assert "network=small_cnn" in found


def test_a_sweep_is_named_by_its_settings():
    first, again, other = (complete(["-m", f"seed={s}"]) for s in ("0,1", "0,1", "0,2"))
    assert first[-1] == again[-1] != other[-1]
    assert first[-1].startswith("hydra.sweep.dir=${paths.outputs}/")
    assert complete(["-m", "seed=0,1", "hydra.sweep.dir=x"])[-1] == "hydra.sweep.dir=x"


def test_the_newest_run_is_resumed(run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match="no run under outputs/train"):
        complete(["resume=latest"])
    for name, changed in (("a", 20), ("b", 30), ("c", 10)):
        shutil.copytree(run / ".hydra", folder := tmp_path / "mine" / "train" / "runs" / name)
        (folder / "checkpoints").mkdir()
        (folder / "checkpoints" / "last.pt").touch()
        os.utime(folder / "checkpoints" / "last.pt", (99, changed))
    found = complete(["resume=latest", "paths.outputs=mine"])
    assert "resume=mine/train/runs/b" in found
    assert "hydra.run.dir='mine/train/runs/b'" in found


def test_a_folder_whose_name_hydra_would_parse_is_quoted(run):
    odd = run.rename(run.with_name("a, b=[1] 'c'"))
    resume = next(o for o in complete([f"resume={odd}"]) if o.startswith("resume="))
    parsed = OverridesParser.create().parse_override(resume).value()
    assert str(parsed) == str(odd)


def test_a_run_is_resumed_in_its_own_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    check_folder("run", tmp_path / "run")
    with pytest.raises(InputError, match=r"hydra.run.dir=.*other differs; omit"):
        check_folder("run", tmp_path / "other")


@pytest.fixture
def typed(monkeypatch):
    """Stands in for the command that Hydra has composed."""
    config = OmegaConf.create({"hydra": {"overrides": {"task": []}}})
    monkeypatch.setattr(resuming.HydraConfig, "get", lambda: config.hydra)
    return config.hydra.overrides.task


def test_settings_are_noted_as_hydra_would(run, typed):
    words = ["resume=x", "task.cube_color=[0.1, 0.2]", "seed=3", "experiment=smoke"]
    typed.extend(words)
    note_settings(run)
    assert read_overrides(run) == words


def test_the_command_to_resume_repeats_what_no_file_may_set(typed, tmp_path):
    typed.extend(["paths.outputs=x", "seed=3", "resume=y", "logger.tensorboard.log_dir=/a b"])
    words = shlex.split(resume_command(tmp_path / "a b"))
    folder = f"resume='{tmp_path}/a b'"
    assert words == ["drone-rl", "train", folder, "logger.tensorboard.log_dir=/a b"]


def test_resume_without_a_run(tmp_path):
    with pytest.raises(InputError, match="folder of a run"):
        complete([f"resume={tmp_path}"])


def test_a_path_in_a_run_suggests_the_run(run):
    for path in ("checkpoints", "checkpoints/last.pt", "checkpoints/policy.safetensors"):
        with pytest.raises(InputError, match=f"; give its folder, resume={run}$"):
            complete([f"resume={run}/{path}"])
