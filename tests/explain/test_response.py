import numpy as np
import torch

from drone_rl.explain.hooks import probabilities
from drone_rl.explain.response import ResponseMap, asymmetry, grid_asymmetry, response_map
from drone_rl.explain.scenes import place_cube
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


def test_a_place_on_the_grid_is_that_place_in_the_world(scenes, world):
    found = response_map(scenes, world[2], num_lateral=5, num_forward=4)
    assert found.probabilities.shape == (4, 5, 3)
    assert found.lateral.tolist() == [12, 6, 0, -6, -12] and found.forward[-1] == 15
    assert (found.oracle == [[1, 1, 0, 2, 2]] * 4).all()
    at = place_cube(scenes, torch.tensor([found.forward[1]]), torch.tensor([found.lateral[3]]))
    expected = probabilities(world[2], scenes.observe(at))[0].numpy()
    np.testing.assert_allclose(found.probabilities[1, 3], expected, atol=1e-6)


def test_blind_is_where_a_turn_is_called_for_and_nothing_changes():
    idle, left = [1.0, 0.0, 0.0], [0.1, 0.9, 0.0]
    found = ResponseMap(
        forward=np.array([5.0]),
        lateral=np.array([6.0, 3.0, 0.0, -6.0]),
        probabilities=np.array([[idle, left, idle, left]]),
        without_cube=np.array(idle),
        oracle=np.array([[1, 1, 0, 2]]),
    )
    # unnoticed; noticed; rightly ignored; noticed, though answered wrongly
    assert found.blind.tolist() == [[True, False, False, False]]
    summary = found.summary()
    assert summary["agrees_with_oracle"] == 0.5 and summary["left_blind"] == 0.5
    assert found.answered.tolist() == [False, True, True, False]
    assert summary["right_agrees"] == 0.0 and summary["right_blind"] == 0.0


def test_a_fair_policy_equals_its_mirror_image_and_a_biased_one_does_not():
    x, episode = torch.randn(40, 1, 1, 4), np.arange(40)
    fair, biased = asymmetry(sides(0.0), x, episode), asymmetry(sides(2.0), x, episode)
    assert fair["absolute"]["mean"] < 1e-6
    assert biased["absolute"]["mean"] > 0.1
    assert biased["signed"]["upper95"] < 0  # right is preferred
    assert biased["worst"][0]["distance"] >= biased["worst"][1]["distance"]


def test_asymmetry_of_a_grid_by_hand():
    probs = np.array([[[0.2, 0.8, 0.0], [1.0, 0.0, 0.0], [1.0, 0.0, 0.0]]])  # sees only the left
    found = ResponseMap(
        np.array([5.0]), np.array([3.0, 0.0, -3.0]), probs, probs[0, 1], np.array([[1, 0, 2]])
    )
    result = grid_asymmetry(found)
    assert result["worst"] == {"distance": 0.8, "forward": 5.0, "lateral": 3.0}
    assert abs(result["signed"] - 0.8 / 3) < 1e-9
