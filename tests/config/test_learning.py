"""What an objective needs, what is its loss's, and what its learner's."""

import pytest

from drone_rl.config.learning import (
    A2c,
    Episodes,
    Gae,
    LeaveOneOut,
    Ppo,
    Ray,
    Reinforce,
    Rollouts,
)
from drone_rl.config.training import TrainSettings
from drone_rl.utils.errors import InputError


@pytest.mark.parametrize("objective", [A2c(), Ppo()])
def test_a_new_objective_changes_returns_and_collector(objective):
    told = TrainSettings().replace(objective=objective, seed=3)
    assert (told.returns, told.collector) == (Gae(), Rollouts())
    assert (told.objective, told.seed) == (objective, 3)


def test_given_settings_are_kept():
    told = TrainSettings().replace(objective=Ppo(), collector=Rollouts(num_envs=5))
    assert told.collector.num_envs == 5
    again = told.replace(returns=Gae(gamma=0.5)).replace(objective=A2c())
    assert (again.collector.num_envs, again.returns.gamma) == (5, 0.5)


@pytest.mark.parametrize("collector", [Episodes(), Ray()])
def test_critics_need_rollouts(collector):
    message = f"^objective=ppo requires collector=rollouts, got collector={collector.name}$"
    with pytest.raises(InputError, match=message):
        TrainSettings().replace(objective=Ppo(), collector=collector)


def test_returns_and_critics_belong_together():
    with pytest.raises(InputError, match=r"^objective=a2c requires returns=gae, got returns=l"):
        TrainSettings(objective=A2c(), collector=Rollouts(), returns=LeaveOneOut())
    message = "{} requires a critic, which objective=reinforce does not have; set objective=ppo or"
    with pytest.raises(InputError, match=message.format("returns=gae")):
        TrainSettings(returns=Gae())
    with pytest.raises(InputError, match=message.format("collector=rollouts")):
        TrainSettings(collector=Rollouts())
    with pytest.raises(InputError, match=r"or choose a different value of returns$"):
        TrainSettings().replace(objective=Ppo()).replace(objective=Reinforce())


def test_combinations_with_other_packages_are_accepted():
    config = TrainSettings().replace(objective=Ppo()).config()
    config["collector"] = {"_target_": "mine.Collector", "num_envs": 3}
    assert TrainSettings.read(config).collector.target == "mine.Collector"


def test_the_loss_gets_its_own_settings():
    assert Ppo(clip_epsilon=0.1).arguments() == {
        "critic_coeff": Ppo().critic_coeff,
        "entropy_coeff": Ppo().entropy_coeff,
        "clip_epsilon": 0.1,
    }


def test_a_setting_of_torchrls_loss_that_is_not_ours_is_passed_on():
    config = {"_target_": Ppo.target, "clip_value": 0.3, "epochs": 5, "shares_trunk": False}
    told = TrainSettings.read({**TrainSettings().replace(objective=Ppo()).config()})
    mine = TrainSettings.read({**told.config(), "objective": config}).objective
    assert mine.arguments() == {"clip_value": 0.3} and type(mine).factory is Ppo.factory
    assert mine.passes == {"epochs": 5, "minibatch_size": Ppo().minibatch_size}
