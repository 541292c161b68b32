"""The learners support continuous actions; gradients are computed by hand."""

import math

import pytest
import torch
from tensordict import TensorDict
from torchrl.objectives import A2CLoss, ClipPPOLoss

from drone_rl.objectives import Advantages, ReinforceLoss
from drone_rl.policies import MLP, ActorCritic, make_actor
from drone_rl.policies.actor import SquashedNormal
from drone_rl.sim.continuous_actions import ContinuousActions
from drone_rl.training import ActorCriticLearner
from tests.continuous import SETTINGS, make_env

ACTIONS = ContinuousActions.of(SETTINGS)
SHAPE = (1, 1, 2)
DEVIATION = math.exp(-0.5)
"""Standard deviation of each component for an untrained policy."""


def generator(seed=0):
    return torch.Generator().manual_seed(seed)


@pytest.fixture
def policy():
    """Return a linear policy with zero weights: means 0, deviations exp(-0.5) everywhere."""
    network = MLP(SHAPE, 6, hidden=(), generator=generator())
    network.actions = ACTIONS
    torch.nn.init.zeros_(network.layers[-1].weight)
    env = make_env(1)
    actor = make_actor(network, env.action_spec, generator(1))
    env.close()
    return network, actor


def steps(count=7):
    pixels = torch.randn(count, *SHAPE, generator=generator(2))
    action = ACTIONS.sample((count,), generator(3))
    returns = torch.randn(count, 1, generator=generator(4))
    return TensorDict({"pixels": pixels, "action": action, "return_to_go": returns}, [count])


def log_prob_gradient(action):
    """Return d log p / d outputs at outputs of 0. Shape: (n, 6).

    For the mean it is (u - 0) / s^2, for the deviation (z^2 - 1) times the slope of its logarithm.
    """
    number = action.atanh()
    return torch.cat([number / DEVIATION**2, ((number / DEVIATION) ** 2 - 1) * 5 / 12], -1)


def test_reinforce_gradient_equals_the_analytic_one(policy):
    network, actor = policy
    batch = steps()
    ReinforceLoss(actor)(batch)["loss_actor"].backward()
    weighted = log_prob_gradient(batch["action"]) * batch["return_to_go"]
    expected = -(weighted.T @ batch["pixels"].reshape(7, 2)) / 7
    torch.testing.assert_close(network.layers[-1].weight.grad, expected, rtol=1e-4, atol=1e-5)


@pytest.mark.parametrize("kind", [A2CLoss, ClipPPOLoss])
def test_actor_critic_gradient_before_the_first_step_is_the_policy_gradient(policy, kind):
    network, _ = policy
    model = ActorCritic(network, None, generator())
    learner = learner_of(network, model, kind)
    batch = steps()
    given = TensorDict({"pixels": batch["pixels"], "action": batch["action"]}, [7])
    advantage = batch["return_to_go"]
    with torch.no_grad():
        chances = model.actor.get_dist(model.trunk(given.clone()))
        assert type(chances) is SquashedNormal
        given.set("action_log_prob", chances.log_prob(batch["action"]))
        values = model.critic(model.trunk(given.clone()))["state_value"]
    given = given.set("advantage", advantage).set("value_target", values)
    learner._losses(given)["loss_objective"].backward()
    expected = (
        -((log_prob_gradient(batch["action"]) * advantage).T @ batch["pixels"].reshape(7, 2)) / 7
    )
    torch.testing.assert_close(network.layers[-1].weight.grad, expected, rtol=1e-4, atol=1e-5)


def learner_of(network, model, kind, rate=0.02, **kwargs):
    return ActorCriticLearner(
        network=network,
        model=model,
        estimator=Advantages(0.98, 0.95, True),
        loss=kind(model.actor, model.critic, functional=False, entropy_coeff=0.001),
        optimizer=torch.optim.Adam(model.parameters(), lr=rate),
        generator=generator(5),
        **kwargs,
    )


def test_reinforce_mean_gradient_equals_that_of_the_expected_reward(policy):
    """The reward is the forward component, so dJ / d mean = E[1 - tanh^2], by quadrature."""
    network, actor = policy
    number = torch.linspace(-8, 8, 10_001, dtype=torch.float64) * DEVIATION
    weight = (-0.5 * (number / DEVIATION) ** 2).exp()
    slope = float(((1 - number.tanh() ** 2) * weight).sum() / weight.sum())
    estimates = []
    for _ in range(40):
        batch = TensorDict({"pixels": torch.zeros(2000, *SHAPE)}, [2000])
        batch = actor(batch)
        batch["return_to_go"] = batch["action"][:, :1]
        network.zero_grad()
        ReinforceLoss(actor)(batch)["loss_actor"].backward()
        estimates.append(-network.layers[-1].bias.grad.clone())
    estimates = torch.stack(estimates)
    error = estimates.std(0) / 40**0.5
    assert error[0] < 0.02 * slope
    expected = torch.tensor([slope, 0, 0, 0, 0, 0])
    assert ((estimates.mean(0) - expected).abs() < 4 * error + 1e-4).all()
