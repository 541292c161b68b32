"""Former names of settings and choices."""

import dataclasses

from drone_rl.config.configuration import as_config, from_config
from drone_rl.config.learning import BatchNormalized, Constant, Episodes, Sgd, Standardized
from drone_rl.config.training import TrainerSettings, TrainSettings
from drone_rl.utils.settings import Settings, current_names

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


def test_nested_settings_may_have_former_names():
    chunked = TrainSettings(trainer=TrainerSettings(minibatch_frames=7))
    assert chunked.trainer.chunk_frames == chunked.trainer.minibatch_frames == 7
    assert not hasattr(chunked.trainer, "optimiser")
    config = as_config(chunked)
    older = {**config["trainer"], "minibatch_frames": config["trainer"].pop("chunk_frames")}
    assert from_config(TrainSettings, {"trainer": older}) == chunked
    found = current_names(TrainSettings, {"trainer": {"minibatch_frames": 7}, "seed": 1})
    assert found == {"trainer": {"chunk_frames": 7}, "seed": 1}
    other = {"network": {"minibatch_frames": 7}, "minibatch_frames": 1, "x": {"y": 1}}
    assert current_names(TrainSettings, other) == other


def test_choices_may_have_former_names():
    named = {"returns": "standardised", "collector": "threads", "scheduler": "none"}
    now = TrainSettings(returns=Standardized(), collector=Episodes(), scheduler=Constant())
    assert TrainSettings(**named) == TrainSettings().replace(**named) == now
    older = {"collector": {"_target_": "threads", "num_envs": 2}, "seed": 3}
    older |= {"returns": {"_target_": "batch_normalised"}}
    read = from_config(TrainSettings, older)
    assert read == TrainSettings(collector=Episodes(num_envs=2), returns=BatchNormalized(), seed=3)
    assert current_names(TrainSettings, older) == {
        "collector": {"_target_": "episodes", "num_envs": 2},
        "returns": {"_target_": "batch_normalized"},
        "seed": 3,
    }
    other = {"network": {"_target_": "threads"}, "device": "none", "collector": {"_target_": 3}}
    assert current_names(TrainSettings, other) == other


def test_a_users_own_setting_of_that_name_stays():
    class Mine(Settings):
        optimiser: str = "x"

    assert current_names(Mine, {"optimiser": "y"}) == {"optimiser": "y"}
    assert Mine().replace(optimiser="y").optimiser == "y"
    assert [field.name for field in dataclasses.fields(Mine)] == ["optimiser"]
