"""Behavior common to stored and external policies."""

import pytest

import drone_rl
from drone_rl.policies.policy import BasePolicy


def straight_on(images):
    import torch

    return torch.tensor([1.0, 0.0, 0.0]).expand(len(images), 3)


@pytest.mark.parametrize("make", [lambda: drone_rl.load_policy("good"),
                                  lambda: drone_rl.policy_from(straight_on)])  # fmt: skip
def test_environment_is_closed_at_the_end_or_on_failure(make):
    policy = make()
    assert isinstance(policy, BasePolicy)
    with pytest.raises(KeyError), policy.in_task(num_cubes=2).flying(3, seed=4) as (env, actor):
        state = actor(env.reset())
        assert state["action"].shape == (3,)
        assert state["info", "cube_positions"].shape == (3, 2, 3)
        raise KeyError
    assert env.is_closed


def test_origin_of_policies():
    good = drone_rl.load_policy("good").origin
    assert good["policy"].endswith("good.safetensors")
    assert good["trained"]["progress"]["frames"] > 0
    assert good["trained"]["command"].startswith("drone-rl train")
    assert drone_rl.policy_from(straight_on).origin == {"policy": "straight_on", "trained": None}
