"""REINFORCE on the three-state process."""

import pytest
import torch

from drone_rl.envs.three_state import exact_gradient
from drone_rl.training.three_state import sample_gradients, train_three_state


def test_training_learns_to_leave_and_is_reproducible():
    found, again = (train_three_state(30, episodes=16, seed=1) for _ in range(2))
    assert found.leaving.shape == (31,) and found.rewards.shape == (30,)
    assert float(found.leaving[0]) == pytest.approx(0.5) and float(found.leaving[-1]) > 0.7
    assert torch.equal(found.leaving, again.leaving)
    assert float(found.rewards.max()) <= 1.0


def test_estimates_scatter_around_the_exact_gradient():
    """With a horizon of 2 that is 0.75 * 2 * (1/2)^1 * (1/2) * (1/2)."""
    estimates = sample_gradients(60, episodes=64, horizon=2, seed=0)
    exact = float(exact_gradient([0.5] * 2).sum())
    assert exact == pytest.approx(0.75 * 2 / 8)
    error = float(estimates.std()) / 60**0.5
    assert abs(float(estimates.mean()) - exact) < 4 * error < 0.05
