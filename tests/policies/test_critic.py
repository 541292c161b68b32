"""Trunk and heads of actor-critic networks; the critic shares the trunk or nothing."""

import copy

import pytest
import torch
from tensordict import TensorDict
from torch import nn

from drone_rl.policies import MLP, ActorCritic, SmallCNN
from drone_rl.policies.critic import LOG_PROB
from drone_rl.utils.errors import InputError
from tests.own_networks import Mirrored

SHAPE = (1, 16, 16)


def generator(seed=0):
    return torch.Generator().manual_seed(seed)


@pytest.fixture(params=[SmallCNN, MLP])
def network(request):
    made = request.param(SHAPE, 3, hidden=(8,), generator=generator())
    nn.init.normal_(made.layers[-1].weight, generator=generator(1))
    return made


def seen(model, count=5):
    pixels = torch.rand(count, *SHAPE, generator=generator(2))
    return pixels, model.critic(model.trunk(TensorDict({"pixels": pixels}, [count])))


def test_trunk_and_head_equal_the_policy(network):
    model = ActorCritic(network)
    pixels, steps = seen(model)
    chances = model.actor.get_dist(steps)
    wanted = network(pixels).log_softmax(-1)
    torch.testing.assert_close(chances.logits, wanted)
    acted = model.actor(steps)
    picked = wanted.gather(-1, acted["action"][:, None])[:, 0]
    torch.testing.assert_close(acted[LOG_PROB], picked)


def test_shared_trunk_has_gradients_of_policy_and_critic(network):
    model = ActorCritic(network, generator=generator())
    own = {name: p for name, p in model.critic.named_parameters()}
    assert {tuple(p.shape) for p in own.values()} == {(1, 8), (1,)}
    assert len(list(model.parameters())) == len(list(network.parameters())) + 2
    pixels, steps = seen(model)
    layer = model.critic.module
    wanted = network.layers[:-1](pixels) @ layer.weight.T + layer.bias
    torch.testing.assert_close(steps["state_value"], wanted)
    steps["state_value"].sum().backward()
    first = next(iter(network.parameters()))
    assert first.grad.abs().sum() > 0
    assert network.layers[-1].weight.grad is None


def test_separate_critic_shares_no_parameters(network):
    own = copy.deepcopy(network)
    own.layers[-1] = nn.Linear(8, 1)
    model = ActorCritic(network, own)
    pixels, steps = seen(model)
    torch.testing.assert_close(steps["state_value"], own(pixels))
    steps["state_value"].sum().backward()
    assert all(p.grad is None for p in network.parameters())
    assert all(p.grad is not None for p in own.parameters())


def test_initial_values_are_small_and_seeded(network):
    values = [seen(ActorCritic(network, generator=generator(s)))[1]["state_value"] for s in (3, 3)]
    assert torch.equal(*values)
    assert 0 < values[0].abs().max() < 0.1
    other = seen(ActorCritic(network, generator=generator(4)))[1]["state_value"]
    assert not torch.equal(values[0], other)


def test_network_without_layers_raises():
    with pytest.raises(
        InputError,
        match=r"of layers, which Linear is not; give objective=",
    ):
        ActorCritic(nn.Linear(4, 2))


def test_a_forward_pass_of_its_own_has_no_critic():
    with pytest.raises(InputError, match=r"which Mirrored is not; .* keep its forward"):
        ActorCritic(Mirrored((1, 25, 64), 3))
