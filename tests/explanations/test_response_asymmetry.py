import numpy as np
import pytest
import torch

from drone_rl.explanations.response import ResponseMap, asymmetry, grid_asymmetry
from drone_rl.policies import MLP
from drone_rl.sim.actions import MOVES, Move


def sides(bias):
    """A policy that compares the halves of a one-row picture, and prefers right by `bias`."""
    network = MLP((1, 1, 4), 3, hidden=())
    with torch.no_grad():
        network.layers.logits.weight.zero_()
        network.layers.logits.weight[Move.LEFT, :2] = 1.0
        network.layers.logits.weight[Move.RIGHT, 2:] = 1.0
        network.layers.logits.bias.copy_(torch.tensor([0.0, 0.0, bias]))
    return network


def test_a_fair_policy_equals_its_mirror_image_and_a_biased_one_does_not():
    x, episode = torch.randn(40, 1, 1, 4), np.arange(40)
    fair, biased = (asymmetry(sides(b), x, episode, MOVES) for b in (0.0, 2.0))
    assert fair["absolute"]["mean"] < 1e-6
    assert biased["absolute"]["mean"] > 0.1
    assert biased["signed"]["upper95"] < 0  # right is preferred
    assert biased["worst"][0]["distance"] >= biased["worst"][1]["distance"]


def test_asymmetry_of_frames_by_hand():
    rng = np.random.default_rng(0)
    x, bias = rng.normal(size=(10, 4)), 0.7
    left, right = x[:, :2].sum(1), x[:, 2:].sum(1)

    def odds(left, right):
        e = np.exp(np.stack([0 * left, left, right + bias], 1))
        return e / e.sum(1, keepdims=True)

    here, there = odds(left, right), odds(right, left)
    distance = 0.5 * np.abs(here - there[:, [0, 2, 1]]).sum(1)
    episode = np.arange(10) // 2
    observed = torch.tensor(x, dtype=torch.float32)[:, None, None]
    found = asymmetry(sides(bias), observed, episode, MOVES)
    assert found["absolute"]["mean"] == pytest.approx(distance.mean(), abs=1e-5)
    assert found["signed"]["mean"] == pytest.approx((here[:, 1] - there[:, 2]).mean(), abs=1e-5)
    assert found["signed"]["lower95"] < -0.5  # few episodes tell little, down to -1
    assert [w["frame"] for w in found["worst"]] == np.argsort(-distance)[:8].tolist()
    worst = [w["distance"] for w in found["worst"]]
    assert worst == pytest.approx(sorted(distance, reverse=True)[:8], abs=1e-5)


def test_a_policy_that_turns_to_either_side_is_its_mirror_image():
    turns = [[0.2, 0.8, 0.0], [1.0, 0.0, 0.0], [0.2, 0.0, 0.8]]
    fair, place = np.tile(turns, (2, 2, 1, 1)), np.array([6.0, 0.0, -6.0])
    found = ResponseMap(
        height=np.array([-1.0, 1.0]),
        forward=np.array([5.0, 9.0]),
        lateral=place,
        probabilities=fair,
        without_target=fair[0, 0, 1],
        oracle=np.array([1, 0, 2]),
        stratum=np.array([0, 1, 2]),
        blind=np.zeros((1, 1, 3), bool),
    )
    result = grid_asymmetry(found, MOVES)
    assert (result["signed"], result["absolute"], result["worst"]["distance"]) == (0.0, 0.0, 0.0)
    found.probabilities[1, 0, 2] = [0.5, 0.0, 0.5]  # high up, near, to the right: less sure
    result = grid_asymmetry(found, MOVES)
    assert result["signed"] == pytest.approx(0.3 / 12)
    assert result["absolute"] == pytest.approx(2 * 0.3 / 12)  # the place and its mirror image
    assert result["worst"] == {
        "distance": pytest.approx(0.3), "height": 1.0, "forward": 5.0, "lateral": 6.0,
    }  # fmt: skip


def test_asymmetry_of_a_grid_by_hand():
    probs = np.array([[[[0.2, 0.8, 0.0], [1.0, 0.0, 0.0], [1.0, 0.0, 0.0]]]])  # sees only the left
    found = ResponseMap(
        height=np.array([0.0]),
        forward=np.array([5.0]),
        lateral=np.array([3.0, 0.0, -3.0]),
        probabilities=probs,
        without_target=probs[0, 0, 1],
        oracle=np.array([1, 0, 2]),
        stratum=np.array([0, 1, 2]),
        blind=np.zeros((1, 1, 3), bool),
    )
    result = grid_asymmetry(found, MOVES)
    assert result["worst"] == {
        "distance": 0.8, "height": 0.0, "forward": 5.0, "lateral": 3.0,
    }  # fmt: skip
    assert abs(result["signed"] - 0.8 / 3) < 1e-9
