"""Bias of estimators and loss, exact by enumeration of all outcomes of small batches (Fig. 3).

The policy observes the one-hot step and has a separate logit for each, the probability of leaving
state 0. So the gradient is a vector whose direction can be wrong.
"""

import itertools
import math

import numpy as np
import pytest
import torch
from scipy.special import gammaln
from tensordict import TensorDict
from tensordict.nn import TensorDictModule
from torch import nn
from torchrl.data import Categorical
from torchrl.modules import ProbabilisticActor

from drone_rl.envs.three_state import SUCCESS_PROBABILITY, exact_gradient
from drone_rl.objectives import (
    LeaveOneOut,
    ReinforceLoss,
    RewardToGo,
    Standardized,
    TimeBaseline,
    TotalReward,
    original_returns,
)
from tests.three_state_episodes import outcomes

EVEN = (0.5, 0.5)
SKEWED = (0.7, 0.2, 0.4)


def expected_update(leaving, estimator, episodes, reduction="sum"):
    """Return the expected gradient ascent step on the logits of action 1, per episode if summed.

    It is exact: the sum over all tuples of outcomes, weighted by their probabilities.
    """
    network = nn.Linear(len(leaving), 2, bias=False)
    with torch.no_grad():
        network.weight.copy_(
            torch.tensor([[0.0] * len(leaving), [math.log(p / (1 - p)) for p in leaving]])
        )
    actor = ProbabilisticActor(
        TensorDictModule(network, in_keys=["step"], out_keys=["logits"]),
        in_keys=["logits"],
        spec=Categorical(2),
        distribution_class=torch.distributions.Categorical,
    )
    loss = ReinforceLoss(actor, reduction=reduction)
    total = torch.zeros(len(leaving), dtype=torch.float64)
    for batch in itertools.product(outcomes(leaving), repeat=episodes):
        network.zero_grad()
        loss(estimator(joined(batch, len(leaving))))["loss_actor"].backward()
        total -= math.prod(o.probability for o in batch) * network.weight.grad[1].double()
    return (total / (episodes if reduction == "sum" else 1)).numpy()


def joined(batch, horizon):
    steps = torch.cat([torch.arange(len(o.actions)) for o in batch])
    following = torch.cat([steps[1:], steps.new_zeros(1)])
    entries = {
        "step": nn.functional.one_hot(steps, horizon).float(),
        "action": torch.tensor([a for o in batch for a in o.actions]),
        "next": {
            "reward": torch.tensor([r for o in batch for r in o.rewards])[:, None],
            "done": (following == 0)[:, None],
        },
    }
    return TensorDict(entries, [len(steps)])


def default_of_any_size(leaving, episodes, gamma=0.95, *, scale=True, mean=True):
    """Return the same for `leave_one_out` on two steps, by an explicit formula for large batches.

    The returns of an episode depend only on its length and reward, so a batch is described by the
    counts of four kinds. The score of a kind is its mean over the actions that lead to it.
    """
    first, second = leaving
    success = SUCCESS_PROBABILITY
    n = episodes
    kinds = [
        (a, b, c, n - a - b - c)
        for a in range(n + 1)
        for b in range(n + 1 - a)
        for c in range(n + 1 - a - b)
    ]
    count = np.array(kinds, float)  # short with reward, short, long with reward, long
    share = np.array([first * success, first * (1 - success), (1 - first) * second * success, 0])
    share[3] = 1 - share.sum()
    probability = np.exp(gammaln(n + 1) - gammaln(count + 1).sum(1) + count @ np.log(share))
    is_long, going_on = np.array([0, 0, 1, 1]), count[:, 2:].sum(1)
    to_go = np.array([1, 0, gamma, 0]), np.array([0, 0, 1, 0])
    credit = to_go[0] - ((count @ to_go[0])[:, None] - to_go[0]) / (n - 1)
    others = (count[:, [2]] - to_go[1]) / np.maximum(going_on - 1, 1)[:, None]
    later = to_go[1] - np.where(going_on > 1, 1, 0)[:, None] * others
    square = (count * (credit**2 + is_long * later**2)).sum(1)
    steps = n + going_on
    rms = np.sqrt(square / steps) if scale else np.ones(len(count))
    weight = np.where(rms > 1e-6, probability / np.maximum(rms, 1e-6), 0) / (steps if mean else n)
    stayed = (
        -second * (1 - second) * success / (1 - second * success)
    )  # score of a long one without reward
    score = np.array([1 - first, 1 - first, -first, -first]), np.array([0, 0, 1 - second, stayed])
    return weight @ np.stack([count * credit @ score[0], count * later * is_long @ score[1]], 1)


def angle(one, other):
    """Return the angle in degrees."""
    cosine = one @ other / np.linalg.norm(one) / np.linalg.norm(other)
    return math.degrees(math.acos(min(1.0, cosine)))


def known_baseline():
    """Return an estimator with given running means."""
    estimator = TimeBaseline(1.0, max_steps=3, scale=False)
    estimator.baseline += torch.tensor([0.7, -0.3, 0.2])
    estimator.estimate = lambda r, d: original_returns.time_baseline(r, d, 1.0, estimator.baseline)
    return estimator


@pytest.mark.parametrize(("leaving", "episodes"), [(EVEN, 3), (SKEWED, 2)])
@pytest.mark.parametrize(
    "make",
    [TotalReward, lambda: RewardToGo(1.0), lambda: LeaveOneOut(1.0, scale=False), known_baseline],
)
def test_unscaled_summed_estimators_are_unbiased(make, leaving, episodes):
    found = expected_update(leaving, make(), episodes)
    np.testing.assert_allclose(found, exact_gradient(leaving), atol=1e-6)


@pytest.mark.parametrize("leaving", [EVEN, SKEWED])
def test_discounted_returns_follow_the_discounted_gradient(leaving):
    exact = exact_gradient(leaving, 0.95).numpy()
    np.testing.assert_allclose(
        expected_update(leaving, LeaveOneOut(0.95, scale=False), 2), exact, atol=1e-6
    )
    np.testing.assert_allclose(expected_update(leaving, RewardToGo(0.95), 1), exact, atol=1e-6)


@pytest.mark.parametrize(("episodes", "degrees", "length"), [(2, 2.89, 0.819), (3, 10.71, 1.093)])
def test_bias_of_the_default_settings(episodes, degrees, length):
    """gamma 0.95, scaled, mean over steps, as in conf/train.yaml."""
    exact = exact_gradient(EVEN, 0.95).numpy()
    found = expected_update(EVEN, LeaveOneOut(0.95, scale=True), episodes, "mean")
    np.testing.assert_allclose(found, default_of_any_size(EVEN, episodes), atol=1e-6)
    assert angle(found, exact) == pytest.approx(degrees, abs=0.01)
    assert np.linalg.norm(found) / np.linalg.norm(exact) == pytest.approx(length, abs=1e-3)


def test_default_approaches_a_multiple_of_the_gradient():
    """The factor 1 / (RMS of centered returns * mean length) is part of the learning rate."""
    found = default_of_any_size(EVEN, 64) / exact_gradient(EVEN, 0.95).numpy()
    # time 0: returns 1, 0, .95, 0 with probability 3/8, 1/8, 3/16, 5/16; time 1: 1, 0 with 3/8, 5/8
    first = 3 / 8 + 0.95**2 * 3 / 16 - (3 / 8 + 0.95 * 3 / 16) ** 2
    rms = ((first + 0.5 * 3 / 8 * 5 / 8) / 1.5) ** 0.5
    np.testing.assert_allclose(found, 1 / (1.5 * rms), rtol=0.02)


def test_standardized_is_biased_for_any_batch_size():
    assert np.abs(expected_update(EVEN, Standardized(1.0), 1)).max() < 1e-6  # no gradient
    skewed = (0.9, 0.1)
    exact = exact_gradient(skewed, 0.95).numpy()
    for episodes in (1, 2):
        found = expected_update(skewed, Standardized(0.95), episodes)
        assert angle(found, exact) == pytest.approx(38.69, abs=0.01)
