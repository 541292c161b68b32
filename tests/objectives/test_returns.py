"""Two episodes of rewards 0, 1, 0, 1 and 1, 0, discount 1/2, worked out by hand."""

import pytest
import torch

from drone_rl.objectives import returns
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


def test_reward_to_go_special_cases():
    check(returns.reward_to_go(REWARD, DONE, 0.0), REWARD[:, 0].tolist())
    check(returns.reward_to_go(REWARD, DONE, 1.0), [2, 2, 1, 1, 1, 0.0])


def test_standardised():
    # first episode: mean 0.84375, deviations -.21875 .40625 -.34375 .15625, variance .0888672
    std = 0.0888671875**0.5
    first = [-0.21875 / std, 0.40625 / std, -0.34375 / std, 0.15625 / std]
    check(returns.standardised(REWARD, DONE, 0.5), [*first, 1.0, -1.0])


def test_standardised_of_a_constant_is_zero_and_never_nan():
    reward = torch.zeros(3, 1)
    done = torch.tensor([[False], [True], [True]])
    assert returns.standardised(reward, done, 0.9).tolist() == [[0.0], [0.0], [0.0]]


def test_linear_ramp():
    check(returns.linear_ramp(REWARD, DONE), [0.5, 1.0, 1.5, 2.0, 0.5, 1.0])


def test_success_scaled():
    e = torch.tensor(1.0).exp().item()
    expected = [v / e for v in TO_GO[:4]] + [1 / e**2, 0.0]
    check(returns.success_scaled(REWARD, DONE, 0.5, max_reward=3.0), expected)


def test_time_baseline_covers_only_the_times_it_knows():
    values = returns.time_baseline(REWARD, DONE, 0.5, torch.tensor([0.5, 0.25]))
    check(values, [0.125, 1.0, 0.5, 1.0, 0.5, -0.25])


def test_leave_one_out():
    # times 0 and 1: minus the other episode's return; then the first goes on alone
    check(returns.leave_one_out(REWARD, DONE, 0.5), [-0.375, 1.25, 0.5, 1.0, 0.375, -1.25])


def test_batch_normalised():
    values = returns.batch_normalised(REWARD, DONE, 0.5)
    assert float(values.mean()) == pytest.approx(0.0, abs=1e-6)
    assert float(values.square().mean()) == pytest.approx(1.0)
    assert returns.batch_normalised(torch.ones(2, 1), torch.ones(2, 1).bool(), 0.5).abs().sum() == 0


def test_scale_to_unit_keeps_zero_and_sign():
    scaled = returns.scale_to_unit(torch.tensor([[3.0], [-4.0], [0.0]]))
    rms = (25 / 3) ** 0.5
    torch.testing.assert_close(scaled, torch.tensor([[3 / rms], [-4 / rms], [0.0]]))
    assert returns.scale_to_unit(torch.zeros(2, 1)).tolist() == [[0.0], [0.0]]


def test_mean_by_time():
    mean, count = returns.mean_by_time(REWARD, DONE)
    assert mean.tolist() == [0.5, 0.5, 0.0, 1.0]
    assert count.tolist() == [2, 2, 1, 1]


ESTIMATORS = {
    "total_reward": lambda r, d: returns.total_reward(r, d),
    "reward_to_go": lambda r, d: returns.reward_to_go(r, d, 0.9),
    "standardised": lambda r, d: returns.standardised(r, d, 0.9),
    "linear_ramp": lambda r, d: returns.linear_ramp(r, d),
    "success_scaled": lambda r, d: returns.success_scaled(r, d, 0.9, 3.0),
    "time_baseline": lambda r, d: returns.time_baseline(r, d, 0.9, torch.tensor([0.3, 0.2])),
    "leave_one_out": lambda r, d: returns.leave_one_out(r, d, 0.9),
    "batch_normalised": lambda r, d: returns.batch_normalised(r, d, 0.9),
}


@pytest.mark.parametrize("name", ESTIMATORS)
def test_flat_and_batched_are_the_same(name):
    reward = torch.randint(0, 2, (3, 5, 1)).float()
    done = torch.zeros(3, 5, 1, dtype=torch.bool)
    done[:, -1] = True
    done[1, 2] = True
    flat = ESTIMATORS[name](reward.flatten(0, 1), done.flatten(0, 1))
    torch.testing.assert_close(ESTIMATORS[name](reward, done).flatten(0, 1), flat)


@pytest.mark.parametrize("name", ESTIMATORS)
def test_unfinished_tail_is_refused(name):
    with pytest.raises(InputError, match="complete episodes"):
        ESTIMATORS[name](torch.zeros(3, 1), torch.tensor([[False], [True], [False]]))


def test_shapes_are_checked():
    with pytest.raises(ValueError, match="must both be"):
        returns.total_reward(torch.zeros(3), torch.ones(3, dtype=torch.bool))


def test_long_batches_do_not_take_a_python_step_a_frame():
    """64 episodes of 130 steps: loops over 130 times, not over 8,320 frames."""
    done = torch.zeros(64, 130, 1, dtype=torch.bool)
    done[:, -1] = True
    calls = []
    original = returns._discount
    returns._discount = lambda padded, gamma: calls.append(len(padded)) or original(padded, gamma)
    try:
        returns.reward_to_go(torch.zeros(64, 130, 1), done, 0.9)
    finally:
        returns._discount = original
    assert calls == [130]
