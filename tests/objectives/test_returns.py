"""Hand-computed returns of two episodes with rewards 0, 1, 0, 1 and 1, 0 and discount 1/2."""

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from drone_rl.objectives import original_returns, returns
from drone_rl.utils.errors import InputError

REWARD = torch.tensor([0.0, 1.0, 0.0, 1.0, 1.0, 0.0])[:, None]
DONE = torch.tensor([0, 0, 0, 1, 0, 1], dtype=torch.bool)[:, None]
TO_GO = [0.625, 1.25, 0.5, 1.0, 1.0, 0.0]


def check(values, expected):
    assert values.shape == REWARD.shape
    torch.testing.assert_close(values[:, 0], torch.tensor(expected), atol=1e-6, rtol=1e-5)


def test_total_reward():
    check(returns.total_reward(REWARD, DONE), [2, 2, 2, 2, 1, 1.0])


def test_reward_to_go():
    check(returns.reward_to_go(REWARD, DONE, 0.5), TO_GO)


def test_standardized():
    # first episode: mean 0.84375, deviations -.21875 .40625 -.34375 .15625, variance .0888672
    std = 0.0888671875**0.5
    first = [-0.21875 / std, 0.40625 / std, -0.34375 / std, 0.15625 / std]
    check(original_returns.standardized(REWARD, DONE, 0.5), [*first, 1.0, -1.0])


def test_standardized_of_a_constant_is_zero():
    reward = torch.zeros(3, 1)
    done = torch.tensor([[False], [True], [True]])
    assert original_returns.standardized(reward, done, 0.9).tolist() == [[0.0], [0.0], [0.0]]


def test_linear_ramp():
    check(original_returns.linear_ramp(REWARD, DONE), [0.5, 1.0, 1.5, 2.0, 0.5, 1.0])


def test_success_scaled():
    e = torch.tensor(1.0).exp().item()
    expected = [v / e for v in TO_GO[:4]] + [1 / e**2, 0.0]
    check(original_returns.success_scaled(REWARD, DONE, 0.5, max_reward=3.0), expected)


def test_time_baseline_applies_to_known_steps_only():
    values = original_returns.time_baseline(REWARD, DONE, 0.5, torch.tensor([0.5, 0.25]))
    check(values, [0.125, 1.0, 0.5, 1.0, 0.5, -0.25])


def test_leave_one_out():
    # steps 0 and 1: minus the other episode's return; then only the first continues
    check(returns.leave_one_out(REWARD, DONE, 0.5), [-0.375, 1.25, 0.5, 1.0, 0.375, -1.25])


def test_batch_normalized():
    # mean 4.375 / 6, mean square 4.203125 / 6: (return - mean) / deviation
    mean = 4.375 / 6
    std = (4.203125 / 6 - mean**2) ** 0.5
    values = returns.batch_normalized(REWARD, DONE, 0.5)
    check(values, [(g - mean) / std for g in TO_GO])
    assert values[1] == values.max() > 1.2 and values[5] == values.min() < -1.7
    constant = returns.batch_normalized(torch.ones(3, 1), torch.ones(3, 1).bool(), 0.5)
    assert constant.tolist() == [[0.0], [0.0], [0.0]]


@pytest.mark.parametrize(("gap", "counts"), [(1e-7, False), (1e-5, True)])
def test_rounding_errors_are_not_scaled_up(gap, counts):
    """The deviation of returns 1 and 1 + gap is half the gap."""
    reward = 1 + torch.tensor([[0.0], [gap]], dtype=torch.float64)
    done = torch.ones(2, 1, dtype=torch.bool)
    expected = torch.tensor([[-1.0], [1.0]]) * counts
    values = returns.batch_normalized(reward, done, 0.0)
    torch.testing.assert_close(values, expected, atol=0.05, rtol=0)
    values = original_returns.standardized(reward, torch.tensor([[False], [True]]), 0.0)
    torch.testing.assert_close(values, expected, atol=0.05, rtol=0)
    scaled = returns.scale_to_unit(torch.tensor([[-gap], [gap]]))
    torch.testing.assert_close(scaled, expected)


def test_equal_episodes_have_zero_credit():
    """With three returns of 0.95, float32 gives 6e-8 instead of 0, which must not become 1."""
    reward = torch.tensor([0.0, 1.0] * 3)[:, None]
    done = torch.tensor([False, True] * 3)[:, None]
    credit = returns.leave_one_out(reward, done, 0.95)
    assert 0 < credit.abs().max() < 1e-6
    assert returns.scale_to_unit(credit).tolist() == [[0.0]] * 6


def test_scale_to_unit_keeps_zero_and_sign():
    scaled = returns.scale_to_unit(torch.tensor([[3.0], [-4.0], [0.0]]))
    rms = (25 / 3) ** 0.5
    torch.testing.assert_close(scaled, torch.tensor([[3 / rms], [-4 / rms], [0.0]]))
    assert returns.scale_to_unit(torch.zeros(2, 1)).tolist() == [[0.0], [0.0]]


ESTIMATORS = {
    "total_reward": lambda r, d: returns.total_reward(r, d),
    "reward_to_go": lambda r, d: returns.reward_to_go(r, d, 0.9),
    "standardized": lambda r, d: original_returns.standardized(r, d, 0.9),
    "linear_ramp": lambda r, d: original_returns.linear_ramp(r, d),
    "success_scaled": lambda r, d: original_returns.success_scaled(r, d, 0.9, 3.0),
    "time_baseline": lambda r, d: original_returns.time_baseline(
        r, d, 0.9, torch.tensor([0.3, 0.2])
    ),
    "leave_one_out": lambda r, d: returns.leave_one_out(r, d, 0.9),
    "batch_normalized": lambda r, d: returns.batch_normalized(r, d, 0.9),
}


ALONE = ["total_reward", "reward_to_go", "standardized", "linear_ramp", "success_scaled"]
"""Estimators that treat each episode separately; `time_baseline` is another."""
EPISODES = st.lists(
    st.lists(st.integers(0, 12).map(lambda n: n / 4), min_size=1, max_size=5),
    min_size=1,
    max_size=4,
)
"""Rewards of up to four episodes, multiples of 1/4, so sums are exact."""
QUICK = settings(max_examples=25, deadline=None)


def flat(episodes):
    reward = torch.tensor([r for episode in episodes for r in episode])[:, None]
    done = torch.zeros(len(reward), 1, dtype=torch.bool)
    done[torch.tensor([len(e) for e in episodes]).cumsum(0) - 1] = True
    return reward, done


def split(values, episodes):
    return [v[:, 0].tolist() for v in values.split([len(e) for e in episodes])]


@given(EPISODES)
@QUICK
def test_flat_and_batched_returns_are_equal(episodes):
    """Every row contains all episodes, so rows have the same length."""
    reward, done = flat(episodes)
    rows, ends = torch.stack([reward, 2 * reward]), torch.stack([done, done])
    for name, estimate in ESTIMATORS.items():
        one = estimate(rows.flatten(0, 1), ends.flatten(0, 1))
        assert torch.equal(estimate(rows, ends).flatten(0, 1), one), name


@given(EPISODES)
@QUICK
def test_episodes_are_independent(episodes):
    whole = flat(episodes)
    for name in (*ALONE, "time_baseline"):
        alone = torch.cat([ESTIMATORS[name](*flat([episode])) for episode in episodes])
        torch.testing.assert_close(ESTIMATORS[name](*whole), alone, atol=1e-5, rtol=1e-5)


@pytest.mark.parametrize("name", ESTIMATORS)
def test_unfinished_tail_raises(name):
    with pytest.raises(InputError, match="complete episodes"):
        ESTIMATORS[name](torch.zeros(3, 1), torch.tensor([[False], [True], [False]]))


def test_invalid_shapes_raise():
    for shape in ((3,), (3, 2), (3, 0)):
        with pytest.raises(ValueError, match="must both be"):
            returns.total_reward(torch.zeros(shape), torch.ones(shape, dtype=torch.bool))
    for count in (2, 4):
        with pytest.raises(ValueError, match="must both be"):
            returns.total_reward(torch.zeros(count, 1), torch.ones(3, 1, dtype=torch.bool))
