import pytest
import torch
from torchrl.envs.utils import check_env_specs

from drone_rl.envs.three_state import ThreeStateEnv, exact_gradient
from tests.three_state_episodes import outcomes


def test_specs():
    check_env_specs(ThreeStateEnv(4))


def test_action_one_succeeds_with_probability_0_75():
    env = ThreeStateEnv(20_000)
    state = env.reset().set("action", torch.ones(20_000).long())
    after = env.step(state)["next"]
    assert after["terminated"].all()
    assert abs(float(after["reward"].mean()) - 0.75) < 4 * (0.75 * 0.25 / 20_000) ** 0.5
    assert torch.equal(after["reward"][:, 0], after["observation"][:, 2])


def test_outcomes_of_two_steps_match_hand_computed_ones():
    """Leave at once (1/5), later (4/5 * 1/2), or stay (4/5 * 1/2); 3/4 of departures succeed."""
    found = {(o.actions, o.rewards): o.probability for o in outcomes([0.2, 0.5])}
    assert found == pytest.approx(
        {
            ((1,), (1.0,)): 0.15,
            ((1,), (0.0,)): 0.05,
            ((0, 1), (0.0, 1.0)): 0.3,
            ((0, 1), (0.0, 0.0)): 0.1,
            ((0, 0), (0.0, 0.0)): 0.4,
        }
    )


@pytest.mark.parametrize("gamma", [1.0, 0.9])
def test_exact_gradient_is_the_sum_over_outcomes(gamma):
    """The sum is over score_t g_t, with g_t the discounted return; score = action - p."""
    leaving = [0.3, 0.6, 0.2]
    total = torch.zeros(3, dtype=torch.float64)
    for p, actions, rewards in outcomes(leaving):
        for t, action in enumerate(actions):
            to_go = sum(gamma**i * r for i, r in enumerate(rewards[t:]))
            total[t] += p * (action - leaving[t]) * to_go
    torch.testing.assert_close(exact_gradient(leaving, gamma), total)


def test_exact_gradient_is_the_derivative_of_the_expected_reward():
    def reward(logits):
        stayed, total = 1.0, 0.0
        for leave in logits.sigmoid():
            total, stayed = total + 0.75 * stayed * leave, stayed * (1 - leave)
        return total

    logits = torch.tensor([0.4, -1.0, 0.3], dtype=torch.float64, requires_grad=True)
    (gradient,) = torch.autograd.grad(reward(logits), logits)
    torch.testing.assert_close(exact_gradient(logits.sigmoid().tolist()), gradient)
    assert exact_gradient([0.5]).tolist() == [0.75 / 4]


def test_truncation_is_at_the_horizon_and_termination_before():
    env = ThreeStateEnv(3, horizon=2)
    state = env.reset()
    state = env.step(state.set("action", torch.tensor([0, 1, 0])))["next"]
    assert state["terminated"][:, 0].tolist() == [False, True, False]
    assert not state["truncated"].any()
    state = env.step(state.set("action", torch.tensor([0, 1, 1])))["next"]
    assert state["terminated"][:, 0].tolist() == [False, True, True]
    assert state["truncated"][:, 0].tolist() == [True, False, False]
    assert state["done"].all()
    assert state["reward"][1] == 0.0  # a terminated environment gives no more reward


def test_partial_reset_keeps_the_other_environments():
    env = ThreeStateEnv(2, horizon=5)
    state = env.step(env.reset().set("action", torch.tensor([1, 0])))["next"]
    state["_reset"] = torch.tensor([[True], [False]])
    again = env.reset(state)
    assert again["observation"][0].tolist() == [1.0, 0.0, 0.0]
    assert env._steps.tolist() == [0, 1]
    assert not again["done"].any()
