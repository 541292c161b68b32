"""Patches, their effects, scores of maps, placebos and shuffled weights."""

import numpy as np
import pytest
import torch

from drone_rl.explanations.patches import (
    PatchGrid,
    has_effect,
    horizon_row,
    likeness,
    make_grid,
    patch_effects,
    placebo_maps,
    pointing,
    scores,
    shuffled_networks,
)
from drone_rl.policies import MLP, SmallCNN


@pytest.mark.parametrize(
    ("size", "grid"),
    [
        ((25, 64), PatchGrid(5, 8, 5, 8)),
        ((36, 64), PatchGrid(7, 8, 5, 8)),
        ((8, 8), PatchGrid(1, 1, 8, 8)),
        ((1, 7), PatchGrid(1, 1, 1, 7)),
    ],
)
def test_the_grid_has_about_forty_nearly_square_patches(size, grid):
    assert make_grid(*size) == grid


def test_means_by_hand():
    maps = torch.tensor([[[1.0, 3.0, 0.0, 0.0], [5.0, 7.0, 0.0, 2.0]]])
    assert PatchGrid(2, 2, 1, 2).means(maps).tolist() == [[4.0, 0.5]]


GRID = PatchGrid(1, 1, 2, 2)


@pytest.fixture
def network():
    """Odds of the second action: e to the sum of the pixels weighted 0, 1, 2, 3."""
    made = MLP((1, 2, 2), 2, hidden=())
    with torch.no_grad():
        made.layers.logits.weight.copy_(torch.tensor([[0.0] * 4, [0.0, 1.0, 2.0, 3.0]]))
    return made


def odds(logit):
    return 1 / (1 + np.exp(-logit))


def test_effects_are_means_over_alternatives(network):
    x = torch.zeros(1, 1, 2, 2)
    found = patch_effects(network, x, [torch.ones_like(x), x, -torch.ones_like(x)], GRID)
    expected = [2 * (odds(w) - 0.5) / 3 for w in (0, 1, 2, 3)]
    np.testing.assert_allclose(found[0], expected, atol=1e-6)


def test_scores_by_hand():
    effects = np.array([[0.0, 0.1, 0.2, 0.4]] * 5)
    heat = np.array(
        [[1, 2, 3, 4], [4, 3, 2, 1], [7, 7, 7, 7], [0, 0, 0, 0], [1, 1, 2, 2]], np.float64
    )
    # mid-ranks 1.5 1.5 3.5 3.5 against 1 2 3 4: covariance 4, deviations sqrt(4) and sqrt(5)
    np.testing.assert_allclose(scores(heat, effects), [1, -1, 0, 0, 4 / np.sqrt(4 * 5)])


def test_pointing_by_hand():
    effects = np.array([[0.0] * 15 + [0.1, 0.2, 0.3, 0.4, 0.5]])  # the top tenth: the last two
    best, second, third = (np.eye(20)[None, i] for i in (19, 18, 17))
    assert [pointing(h, effects)[0][0] for h in (best, second, third)] == [1, 1, 0]
    assert pointing(best, effects)[1][0] == 2 / 20
    assert pointing(best + second + third, effects)[0][0] == pytest.approx(2 / 3)
    ones = pointing(np.ones((1, 20)), effects)
    assert ones[0] == ones[1] == 0.1  # a map of ones hits as chance does


def test_pointing_where_patches_tie():
    hit, chance = pointing(np.eye(20)[:2], np.array([[0.3] * 5 + [0.0] * 15] * 2))
    assert (hit.tolist(), chance.tolist()) == ([1, 1], [0.25, 0.25])
    hit, chance = pointing(np.eye(20)[:2], np.array([[0.3] + [0.0] * 19] * 2))
    assert (hit.tolist(), chance.tolist()) == ([1, 0], [0.05, 0.05])  # no effect is not the most


def test_frames_without_an_effect():
    effects = np.array([[0.0, 0.99e-4], [0.0, 1e-4], [0.2, 0.5]])
    assert has_effect(effects).tolist() == [False, True, True]


def test_placebos_by_hand():
    absent = torch.zeros(1, 6, 10)
    absent[:, :2] = 1.0  # sky above the third row
    x = absent.repeat(2, 1, 1, 1)
    x[1, 0, 4, 7] = 3.0
    maps = placebo_maps(x, absent, [x + 1, x + 2])
    assert all(m.shape == (2, 6, 10) and (m >= 0).all() for m in maps.values())
    assert maps["ones"].unique().tolist() == [1.0]
    assert maps["difference to the empty scene"].nonzero().tolist() == [[1, 4, 7]]
    assert maps["difference to the empty scene"].max() == 3.0
    assert maps["difference to the empty scene, smoothed"][1].argmax() == 47
    assert maps["mean difference to re-rendered patches"].unique().tolist() == [1.5]
    assert horizon_row(absent) == 1.5
    assert maps["horizon"][0, :, 3].argsort(descending=True)[:2].sort().values.tolist() == [1, 2]
    torch.testing.assert_close(maps["blob in the middle"], maps["blob in the middle"].flip(1, 2))
    assert maps["blob in the middle"][0].argmax() in (24, 25, 34, 35)
    assert not torch.equal(maps["noise"][0], maps["noise"][1])


OBSERVATIONS = torch.randn(20, 1, 25, 64, generator=torch.Generator().manual_seed(0))


def test_weights_are_shuffled_within_their_layer():
    network = SmallCNN((1, 25, 64), 3, channels=(4,), hidden=(8,))
    before = {k: v.clone() for k, v in network.state_dict().items()}
    first, second = shuffled_networks(network, OBSERVATIONS, 2)
    for name, values in before.items():
        assert torch.equal(network.state_dict()[name], values)
        for other in (first, second) if "logits" not in name else ():
            shuffled = other.state_dict()[name]
            assert torch.equal(shuffled.flatten().sort().values, values.flatten().sort().values)
            if "weight" in name:
                assert not torch.equal(shuffled, values)
    assert not torch.equal(first.layers.fc1.weight, second.layers.fc1.weight)
    assert first.layers.conv1.weight.is_contiguous(memory_format=torch.channels_last)


def test_shuffled_policies_have_the_same_mean_and_deviation():
    network = SmallCNN((1, 25, 64), 3, channels=(4,), hidden=(8,))
    with torch.no_grad():
        network.layers.logits.weight.mul_(torch.tensor([[1.0], [50.0], [400.0]]))
        network.layers.logits.bias.copy_(torch.tensor([7.0, -3.0, 0.5]))
        logits = network(OBSERVATIONS)
        for other in shuffled_networks(network, OBSERVATIONS, 3):
            made = other(OBSERVATIONS)
            torch.testing.assert_close(made.mean(0), logits.mean(0), rtol=1e-3, atol=1e-3)
            torch.testing.assert_close(made.std(0), logits.std(0), rtol=1e-3, atol=1e-3)
            weights = [n.layers.logits.weight.flatten() for n in (network, other)]
            assert not torch.equal(weights[0].sort().values, weights[1].sort().values)


def test_a_constant_policy_stays_constant_when_shuffled():
    network = MLP((1, 25, 64), 3, hidden=(5,))
    with torch.no_grad():
        network.layers.fc1.bias.fill_(-1e4)
        network.layers.logits.bias.copy_(torch.tensor([1.0, 2.0, 3.0]))
        (other,) = shuffled_networks(network, OBSERVATIONS, 1)
        expected = torch.tensor([1.0, 2.0, 3.0]).expand(20, 3)
        torch.testing.assert_close(other(OBSERVATIONS), expected)


def test_likeness_by_hand():
    first = torch.tensor([[[1.0, 2.0, 3.0, 0.0, 0.0]]])
    assert likeness(first, torch.tensor([[[3.0, 2.0, 1.0, 0.0, 0.0]]])).tolist() == [-1.0]
    assert likeness(first, 7 * first).tolist() == [1.0]
    # pixel 3 has heat in one of them and counts: ranks 2 3 4 1 and 3 2 1 4
    found = likeness(first, torch.tensor([[[0.2, 0.1, 0.0, 0.3, 0.0]]]))
    np.testing.assert_allclose(found, -1.0)


def test_maps_without_heat_show_no_dependence():
    none, some = torch.zeros(1, 2, 2), torch.tensor([[[1.0, 2.0], [3.0, 4.0]]])
    assert likeness(none, some) == likeness(some, none) == likeness(none, none) == 1.0
