"""A picture of 2x2 patches, one pixel each, on a policy whose every probability is known."""

import numpy as np
import pytest
import torch

from drone_rl.explanations.patches import (
    Grid,
    has_effect,
    patch_effects,
    pointing,
    rank_correlation,
    sample_frames,
    scores,
    summarise_scores,
)
from drone_rl.policies import MLP
from drone_rl.utils.intervals import episode_means

GRID = Grid(1, 1, 2, 2)


@pytest.fixture
def network():
    """Odds of the second action: e to the sum of the pixels weighted 0, 1, 2, 3."""
    made = MLP((1, 2, 2), 2, hidden=())
    with torch.no_grad():
        made.layers.logits.weight.copy_(torch.tensor([[0.0] * 4, [0.0, 1.0, 2.0, 3.0]]))
    return made


def odds(logit):
    return 1 / (1 + np.exp(-logit))


def test_effects_by_hand(network):
    x, other = torch.zeros(1, 1, 2, 2), torch.ones(1, 1, 2, 2)
    expected = [odds(w) - 0.5 for w in (0, 1, 2, 3)]
    np.testing.assert_allclose(patch_effects(network, x, [other], GRID)[0], expected, atol=1e-6)


def test_effects_are_the_mean_over_alternatives_also_of_those_that_change_nothing(network):
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


def test_rounding_errors_are_no_heat_and_no_effect():
    effects = np.array([[0.0, 0.1, 0.2, 0.4], [1e-8, 2e-8, 3e-8, 4e-8]])
    heat = np.array([[1.0, 1 + 1e-9, 1 + 2e-9, 1 + 3e-9], [1.0, 2.0, 3.0, 4.0]])
    assert scores(heat, effects).tolist() == [0.0, 0.0]


def test_heat_has_no_unit_and_effects_that_differ_by_rounding_are_equal():
    effects = np.array([[0.1, 0.2, 0.3 - 1e-12, 0.3 + 1e-12]])
    heat = np.array([[1.0, 2.0, 3.0, 3.0]])
    for unit in (1e-9, 1.0, 1e9):
        np.testing.assert_allclose(scores(unit * heat, effects), [1.0])
        assert pointing(unit * heat, effects)[0].tolist() == [1.0]


def test_a_map_without_heat_points_nowhere_more_than_anywhere():
    hit, chance = pointing(np.zeros((1, 20)), np.array([[0.5] + [0.1] * 18 + [0.4]]))
    assert hit[0] == chance[0] == 0.1


def test_a_map_of_ones_scores_nothing_whatever_the_policy(network):
    x = torch.rand(20, 1, 2, 2)
    effects = patch_effects(network, x, [torch.rand(20, 1, 2, 2)], GRID)
    assert (scores(GRID.means(torch.ones(20, 2, 2)), effects) == 0).all()
    assert scores(GRID.means(x[:, 0]), effects).any()


def test_pointing_by_hand():
    effects = np.array([[0.0] * 15 + [0.1, 0.2, 0.3, 0.4, 0.5]])  # the top tenth: the last two
    best, second, third = (np.eye(20)[None, i] for i in (19, 18, 17))
    assert [pointing(h, effects)[0][0] for h in (best, second, third)] == [1, 1, 0]
    assert pointing(best, effects)[1][0] == 2 / 20
    assert pointing(best + second + third, effects)[0][0] == pytest.approx(2 / 3)
    ones = pointing(np.ones((1, 20)), effects)
    assert ones[0] == ones[1] == 0.1  # a map of ones hits as chance does


def test_of_few_patches_one_moves_the_policy_most():
    hit, chance = pointing(np.eye(5)[3:], np.array([[0.1, 0.2, 0.3, 0.4, 0.5]] * 2))
    assert (hit.tolist(), chance.tolist()) == ([0, 1], [0.2, 0.2])


def test_pointing_where_patches_tie():
    hit, chance = pointing(np.eye(20)[:2], np.array([[0.3] * 5 + [0.0] * 15] * 2))
    assert (hit.tolist(), chance.tolist()) == ([1, 1], [0.25, 0.25])
    hit, chance = pointing(np.eye(20)[:2], np.array([[0.3] + [0.0] * 19] * 2))
    assert (hit.tolist(), chance.tolist()) == ([1, 0], [0.05, 0.05])  # no effect is not the most


def test_pictures_on_which_nothing_moves_the_policy():
    effects = np.array([[0.0, 0.99e-4], [0.0, 1e-4], [0.2, 0.5]])
    assert has_effect(effects).tolist() == [False, True, True]


def test_rank_correlation_by_hand():
    first = np.array([[1, 2, 3, 4], [1, 2, 3, 4], [5, 5, 5, 5]], float)
    second = np.array([[10, 20, 30, 40], [4, 3, 2, 1], [1, 2, 3, 4]], float)
    np.testing.assert_allclose(rank_correlation(first, second), [1.0, -1.0, 0.0])
    two = np.array([[1.0, 2.0], [2.0, 1.0]])
    np.testing.assert_allclose(rank_correlation(two, two[:1]), [1.0, -1.0])


def test_episodes_count_alike_however_long():
    values, episode = np.array([1.0, 1.0, 1.0, 0.0]), np.array([7, 7, 7, 9])
    assert episode_means(values, episode).tolist() == [1.0, 0.0]
    found = summarise_scores(values, episode)
    assert (found["mean"], found["count"]) == (0.5, 2)
    assert summarise_scores(np.zeros(0), np.zeros(0))["mean"] is None
    assert summarise_scores(-np.ones(30), np.arange(30))["upper95"] < -0.5


def test_frames_are_spread_over_each_episode():
    episode = np.array([3] * 9 + [5] * 2 + [8])
    assert sample_frames(episode, 3).tolist() == [0, 4, 8, 9, 10, 11]
    assert sample_frames(np.zeros(0), 3).tolist() == []
