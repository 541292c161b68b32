import numpy as np
import torch

from drone_rl.explain.asymmetry import asymmetry, grid_asymmetry
from drone_rl.explain.response import ResponseMap
from drone_rl.policies import MLP
from drone_rl.sim.rules import Action


def sides(bias):
    """A policy that compares the halves of a one-row picture, and prefers right by `bias`."""
    network = MLP((1, 1, 4), 3, hidden=())
    with torch.no_grad():
        network.layers.logits.weight.zero_()
        network.layers.logits.weight[Action.LEFT, :2] = 1.0
        network.layers.logits.weight[Action.RIGHT, 2:] = 1.0
        network.layers.logits.bias.copy_(torch.tensor([0.0, 0.0, bias]))
    return network


def test_a_fair_policy_equals_its_mirror_image_and_a_biased_one_does_not():
    x, episode = torch.randn(40, 1, 1, 4), np.arange(40)
    fair, biased = asymmetry(sides(0.0), x, episode), asymmetry(sides(2.0), x, episode)
    assert fair["absolute"]["mean"] < 1e-6
    assert biased["absolute"]["mean"] > 0.1
    assert biased["signed"]["upper95"] < 0  # right is preferred
    assert biased["worst"][0]["distance"] >= biased["worst"][1]["distance"]


def test_asymmetry_of_a_grid_by_hand():
    probs = np.array([[[[0.2, 0.8, 0.0], [1.0, 0.0, 0.0], [1.0, 0.0, 0.0]]]])  # sees only the left
    found = ResponseMap(
        height=np.array([0.0]),
        forward=np.array([5.0]),
        lateral=np.array([3.0, 0.0, -3.0]),
        probabilities=probs,
        without_cube=probs[0, 0, 1],
        oracle=np.array([1, 0, 2]),
    )
    result = grid_asymmetry(found)
    assert result["worst"] == {
        "distance": 0.8, "height": 0.0, "forward": 5.0, "lateral": 3.0,
    }  # fmt: skip
    assert abs(result["signed"] - 0.8 / 3) < 1e-9
