import numpy as np
import pytest
import torch

from drone_rl.explanations.patches import Grid
from drone_rl.explanations.trust import Trial
from drone_rl.explanations.truth import SHARES, deletion_insertion
from drone_rl.policies import MLP


def curves(network, observations, actions, maps, absent, episode):
    trial = Trial(
        network=network,
        observations=observations,
        actions=actions,
        effects=np.zeros((len(episode), 1)),
        placebos={},
        episode=episode,
        grid=Grid(2, 5, 1, 1),
    )
    return deletion_insertion(trial, maps, absent)


@pytest.fixture
def network():
    """Goes left for sure if the pixel in the second row, third column is bright."""
    made = MLP((1, 2, 5), 3, hidden=())
    with torch.no_grad():
        made.layers.logits.weight.zero_()
        made.layers.logits.weight[1, 7] = 100.0
    return made


def test_curves_of_a_policy_that_looks_at_one_pixel(network):
    x, actions = torch.ones(1, 1, 2, 5), torch.tensor([1])
    right, wrong = torch.zeros(1, 2, 5), torch.ones(1, 2, 5)
    right[0, 1, 2], wrong[0, 1, 2] = 1.0, 0.0  # that pixel first, and last
    absent, episode = torch.zeros(1, 2, 5), np.zeros(1)
    found = curves(network, x, actions, right, absent, episode)["left"]
    gone = [round(10 * share) >= 1 for share in SHARES]  # of ten pixels, 0.075 take one away
    third = pytest.approx(1 / 3)
    assert found["deletion"]["curve"] == [third if g else 1.0 for g in gone]
    assert found["insertion"]["curve"] == [1.0 if g else third for g in gone]
    # the area falls from 1 to 1/3 between 0.05 and 0.075
    assert found["deletion"]["area"]["mean"] == pytest.approx(0.05 + 0.025 * 2 / 3 + 0.925 / 3)
    worse = curves(network, x, actions, wrong, absent, episode)["left"]
    assert worse["deletion"]["curve"] == [1.0] * (len(SHARES) - 1) + [third]
    assert worse["insertion"]["area"]["mean"] < 0.5 < found["insertion"]["area"]["mean"]


def test_actions_are_told_apart_and_episodes_count_alike(network):
    x = torch.ones(4, 1, 2, 5)
    x[3] = 0.0
    actions = torch.tensor([1, 1, 0, 1])
    found = curves(
        network, x, actions, torch.rand(4, 2, 5), torch.zeros(1, 2, 5), np.array([0, 0, 0, 1])
    )
    assert [found[a]["frames"] for a in ("forward", "left", "right")] == [1, 3, 0]
    assert found["left"]["deletion"]["curve"][0] == pytest.approx((1.0 + 1 / 3) / 2)
    assert found["left"]["deletion"]["area"]["count"] == 2
    assert found["forward"]["deletion"]["curve"][0] == pytest.approx(0.0)
    assert found["right"]["deletion"]["curve"] is None
    assert found["right"]["deletion"]["area"]["mean"] is None


def test_steps_are_as_fine_as_a_far_cube():
    assert SHARES[0] == 0.0 and SHARES[-1] == 1.0
    assert max(np.diff(SHARES)[:6]) < 0.026
    assert list(SHARES) == sorted(set(SHARES))
    assert SHARES[1] == 0.01 and max(np.diff(SHARES)) <= 0.2 + 1e-9


def test_without_pictures_there_are_no_curves(network):
    none = torch.zeros(0, 1, 2, 5)
    maps, absent = torch.zeros(0, 2, 5), torch.zeros(1, 2, 5)
    actions = torch.zeros(0, dtype=torch.int64)
    found = curves(network, none, actions, maps, absent, np.zeros(0))
    assert found["left"]["frames"] == 0 and found["left"]["insertion"]["curve"] is None
