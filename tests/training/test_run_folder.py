"""Files that a training reads from and writes to its folder."""

from types import SimpleNamespace
from unittest.mock import patch

import pytest

import drone_rl
from drone_rl.config import TASKS, DynamicsSettings
from drone_rl.config.training import TrainSettings
from drone_rl.sim.tasks.task import MAKERS, as_settings
from drone_rl.training.run_folder import (
    RunFolder,
    confirm_interval_of,
    possible_ends,
    settings_of,
    target_of,
)
from drone_rl.training.train import train
from drone_rl.utils.errors import InputError
from tests.second_task import Posts


def test_checkpoint_settings_are_restored_and_validated():
    settings = TrainSettings(seed=3)
    assert settings_of(settings.config()) == settings
    foreign = {**settings.config(), "network": {"_target_": "os.system"}}
    with pytest.raises(InputError, match=r"the checkpoint uses os\.system"):
        settings_of(foreign)


def test_changed_settings_prevent_resuming(tmp_path):
    state = SimpleNamespace(config=TrainSettings(seed=1).config())
    with pytest.raises(InputError, match="seed=0: the run was started with seed=1"):
        RunFolder(tmp_path).prepare(TrainSettings(), state)


def test_lost_control_is_possible_only_with_dynamics():
    flying = TrainSettings(dynamics=DynamicsSettings(mode="simple_flight"))
    names = [[end.name for end in possible_ends(s)] for s in (TrainSettings(), flying)]
    assert "LOST_CONTROL" not in names[0] and names[1] == [*names[0], "LOST_CONTROL"]


def test_a_task_of_costs_has_no_target():
    class Costs(Posts):
        name, largest_reward = "costs", 0.0

    with patch.dict(TASKS), patch.dict(MAKERS):
        settings = TrainSettings(task=as_settings(Costs()))
        with pytest.raises(InputError, match="task=costs has largest_reward=0, of which no fract"):
            target_of(settings)
    assert target_of(TrainSettings()) == pytest.approx(2.97)  # 0.99 of three cubes


def test_a_task_whose_largest_reward_is_unknown_is_confirmed_regularly():
    class Open(Posts):
        name, largest_reward = "open", None

    with patch.dict(TASKS), patch.dict(MAKERS):
        settings = TrainSettings(task=as_settings(Open()))
        assert target_of(settings) is None
        assert confirm_interval_of(settings) == 125  # 2,000 episodes, 16 at a time: 200 confirm
        often = settings.trainer.replace(confirm_interval=3)
        assert confirm_interval_of(settings.replace(trainer=often)) == 3
        never = settings.trainer.replace(target_share=None)
        assert confirm_interval_of(settings.replace(trainer=never)) is None
    assert confirm_interval_of(TrainSettings()) == 1


def test_a_task_that_no_verdict_accepts_is_refused_before_the_training(tmp_path):
    class Unknown(Posts):
        name, blind_baselines = "unknown", ("up",)

    with patch.dict(TASKS), patch.dict(MAKERS):
        settings = TrainSettings(task=as_settings(Unknown()), evaluate_after=10)
        with pytest.raises(InputError, match="evaluate_after=10: baseline=up of task=unknown"):
            drone_rl.train(settings, folder=tmp_path / "run")
        assert not (tmp_path / "run").exists()
        with pytest.raises(InputError, match="evaluate_after=10 needs a judge"):
            train(settings, folder=tmp_path / "run")
