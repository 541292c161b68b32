import numpy as np
import pytest
import torch

from drone_rl.explain.attribution import Explainer
from drone_rl.explain.intervals import mean_interval
from drone_rl.explain.scenes import Region
from drone_rl.explain.truth import (
    deletion_insertion,
    heat_shares,
    pointing_game,
    randomisation_test,
    rank_correlation,
)
from drone_rl.policies import MLP

REGIONS = np.array([[[Region.NEXT_CUBE, Region.GROUND], [Region.SKY, Region.SKY]]] * 3)


def test_pointing_game_by_hand():
    maps = np.array([[[9, 1], [0, 0]], [[1, 9], [0, 0]], [[0, 0], [0, 0]]], float)
    found = pointing_game(maps, REGIONS, np.array([0, 1, 2]))
    assert found["hit"]["mean"] == pytest.approx(1 / 3)  # a map without heat misses
    assert found["chance"]["mean"] == 0.25
    assert found["maps_without_heat"] == 1


def test_frames_without_the_cube_do_not_count():
    regions = REGIONS.copy()
    regions[1:] = Region.SKY
    found = pointing_game(np.ones((3, 2, 2)), regions, np.arange(3))
    assert found["hit"]["frames"] == 1
    nothing = pointing_game(np.ones((3, 2, 2)), np.full_like(REGIONS, Region.SKY), np.arange(3))
    assert nothing["hit"]["mean"] is None


def test_heat_shares_by_hand():
    maps = np.array([[[6.0, 1.0], [1.0, 2.0]]])
    found = heat_shares(maps, REGIONS[:1], np.zeros(1))
    shares = {name: region["share"]["mean"] for name, region in found.items()}
    assert shares == pytest.approx(
        {"next_cube": 0.6, "other_cube": 0, "horizon": 0, "ground": 0.1, "sky": 0.3}
    )
    assert found["sky"]["chance"]["mean"] == 0.5


def test_deletion_and_insertion_of_a_policy_that_looks_at_one_pixel():
    network = MLP((1, 2, 5), 2, hidden=())
    with torch.no_grad():
        network.layers.logits.weight.zero_()
        network.layers.logits.weight[1, 7] = 100.0
    x, actions = torch.ones(1, 1, 2, 5), torch.tensor([1])
    right, wrong = torch.zeros(1, 2, 5), torch.ones(1, 2, 5)
    right[0, 1, 2], wrong[0, 1, 2] = 1.0, 0.0  # pixel 7 first, and last
    absent, episode = torch.zeros(1, 2, 5), np.zeros(1)
    found = deletion_insertion(network, x, actions, right, absent, episode)
    assert found["deletion"]["curve"] == pytest.approx([1.0] + [0.5] * 10)
    assert found["insertion"]["curve"] == pytest.approx([0.5] + [1.0] * 10)
    assert found["deletion"]["area"]["mean"] == pytest.approx(0.525)
    worse = deletion_insertion(network, x, actions, wrong, absent, episode)
    assert worse["deletion"]["curve"] == pytest.approx([1.0] * 10 + [0.5])


def test_randomisation_goes_from_the_last_layer_and_leaves_the_policy_alone(world, dataset):
    network = world[2]
    before = {k: v.clone() for k, v in network.state_dict().items()}
    explainer = Explainer(network, torch.zeros(1, 25, 64))
    found = randomisation_test(
        explainer, "saliency", dataset.tensor("observations"), dataset.tensor("actions")
    )
    assert found["layers"] == ["logits", "fc1", "conv1"]
    assert len(found["correlation"]) == 3
    assert all(torch.equal(before[k], v) for k, v in network.state_dict().items())


def test_rank_correlation_by_hand():
    first = np.array([[1, 2, 3, 4], [1, 2, 3, 4], [5, 5, 5, 5]], float)
    second = np.array([[10, 20, 30, 40], [4, 3, 2, 1], [1, 2, 3, 4]], float)
    np.testing.assert_allclose(rank_correlation(first, second), [1.0, -1.0, 0.0])


def test_intervals_resample_whole_episodes():
    values, episode = np.repeat([0.0, 1.0], 50), np.repeat([0, 1], 50)
    found = mean_interval(values, episode)
    assert found["mean"] == 0.5 and (found["lower95"], found["upper95"]) == (0.0, 1.0)
    assert (found["frames"], found["episodes"]) == (100, 2)
    alone = mean_interval(values, np.arange(100))
    assert 0.35 < alone["lower95"] < 0.5 < alone["upper95"] < 0.65
    assert mean_interval(np.full(3, np.nan), np.arange(3))["mean"] is None
