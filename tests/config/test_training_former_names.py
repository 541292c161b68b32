"""The optimizer's settings were once called optimiser."""

import dataclasses

from drone_rl.config.configuration import as_config, from_config
from drone_rl.config.learning import Sgd
from drone_rl.config.training import TrainSettings
from drone_rl.utils.settings import Settings, present_names

SGD = TrainSettings(optimizer=Sgd(lr=0.5))


def test_arguments_and_attributes_may_have_the_former_name():
    assert TrainSettings(optimiser=Sgd(lr=0.5)) == SGD
    assert TrainSettings().replace(optimiser=Sgd(lr=0.5)) == SGD
    assert SGD.optimiser is SGD.optimizer


def test_saved_settings_may_have_it_and_are_written_with_the_present_one():
    config = as_config(SGD)
    assert "optimiser" not in config
    older = {"optimiser" if k == "optimizer" else k: v for k, v in config.items()}
    assert from_config(TrainSettings, older) == SGD


def test_a_users_own_setting_of_that_name_stays():
    class Mine(Settings):
        optimiser: str = "x"

    assert present_names(Mine, {"optimiser": "y"}) == {"optimiser": "y"}
    assert Mine().replace(optimiser="y").optimiser == "y"
    assert [field.name for field in dataclasses.fields(Mine)] == ["optimiser"]
