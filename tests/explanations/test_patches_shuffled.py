import numpy as np
import pytest
import torch
from torch import nn

from drone_rl.explanations.patches import likeness, shuffled_networks
from drone_rl.policies import MLP, ExternalNetwork, SmallCNN
from drone_rl.sim.actions import MOVES

PICTURES = torch.randn(20, 1, 25, 64, generator=torch.Generator().manual_seed(0))


def test_weights_are_shuffled_within_their_layer_and_the_policy_stays():
    network = SmallCNN((1, 25, 64), 3, channels=(4,), hidden=(8,))
    before = {k: v.clone() for k, v in network.state_dict().items()}
    first, second = shuffled_networks(network, PICTURES, 2)
    for name, values in before.items():
        assert torch.equal(network.state_dict()[name], values)
        for other in (first, second) if "logits" not in name else ():
            shuffled = other.state_dict()[name]
            assert torch.equal(shuffled.flatten().sort().values, values.flatten().sort().values)
            if "weight" in name:
                assert not torch.equal(shuffled, values)
    assert not torch.equal(first.layers.fc1.weight, second.layers.fc1.weight)
    assert first.layers.conv1.weight.is_contiguous(memory_format=torch.channels_last)


def test_networks_from_elsewhere_are_shuffled_as_ours():
    layers = SmallCNN((1, 25, 64), 3, channels=(4,), hidden=(8,)).layers
    network = ExternalNetwork(nn.Sequential(layers, nn.BatchNorm1d(3)), (1, 25, 64), MOVES)
    (other,) = shuffled_networks(network, PICTURES, 1)
    before, after = network.state_dict(), other.state_dict()
    assert not torch.equal(*(state["_logits.0.conv1.weight"] for state in (before, after)))
    assert all(torch.equal(before[k].flatten().sort().values, after[k].flatten().sort().values)
               for k in before)  # fmt: skip
    with torch.no_grad():
        logits, made = network(PICTURES), other(PICTURES)
    torch.testing.assert_close(made.mean(0), logits.mean(0), rtol=1e-3, atol=1e-3)
    torch.testing.assert_close(made.std(0), logits.std(0), rtol=1e-3, atol=1e-3)


def test_the_first_of_many_are_those_of_few():
    network = MLP((1, 25, 64), 3, hidden=(5,))
    few, many = (list(shuffled_networks(network, PICTURES, n, 3)) for n in (1, 2))
    assert torch.equal(few[0].layers.fc1.weight, many[0].layers.fc1.weight)
    assert not torch.equal(few[0].layers.fc1.weight, many[1].layers.fc1.weight)


def test_shuffled_policies_are_as_lively_as_the_policy():
    network = SmallCNN((1, 25, 64), 3, channels=(4,), hidden=(8,))
    with torch.no_grad():
        network.layers.logits.weight.mul_(torch.tensor([[1.0], [50.0], [400.0]]))
        network.layers.logits.bias.copy_(torch.tensor([7.0, -3.0, 0.5]))
        logits = network(PICTURES)
        for other in shuffled_networks(network, PICTURES, 3):
            made = other(PICTURES)
            torch.testing.assert_close(made.mean(0), logits.mean(0), rtol=1e-3, atol=1e-3)
            torch.testing.assert_close(made.std(0), logits.std(0), rtol=1e-3, atol=1e-3)
            weights = [n.layers.logits.weight.flatten() for n in (network, other)]
            assert not torch.equal(weights[0].sort().values, weights[1].sort().values)


def test_a_policy_that_no_picture_moves_stays_so_when_shuffled():
    network = MLP((1, 25, 64), 3, hidden=(5,))
    with torch.no_grad():
        network.layers.fc1.bias.fill_(-1e4)
        network.layers.logits.bias.copy_(torch.tensor([1.0, 2.0, 3.0]))
        (other,) = shuffled_networks(network, PICTURES, 1)
        expected = torch.tensor([1.0, 2.0, 3.0]).expand(20, 3)
        torch.testing.assert_close(other(PICTURES), expected)


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


def test_maps_that_are_the_same_everywhere_are_alike():
    ones, ramp = torch.ones(1, 2, 2), torch.tensor([[[1.0, 2.0], [3.0, 4.0]]])
    window = torch.tensor([[[1.0, 1.0], [0.0, 0.0]]])
    assert likeness(ones, 3 * ones) == likeness(window, 2 * window) == 1.0
    assert likeness(ones, ramp) == likeness(ramp, ones) == 0.0


def test_rounding_errors_are_no_heat():
    first = torch.tensor([[[1.0, 2.0, 1e-9, 0.0]]])
    assert likeness(first, torch.tensor([[[2.0, 1.0, 0.0, 1e-9]]])).tolist() == [-1.0]


@pytest.mark.parametrize("unit", [1e-4, 1.0, 1e4])
def test_heat_has_no_unit(unit):
    first = unit * torch.tensor([[[1.0, 2.0, 1e-8, 0.0]]]).double()
    second = torch.tensor([[[2.0, 1.0, 0.0, 1e-8]]]).double()
    assert likeness(first, second) == likeness(second, first) == -1.0
    even = unit * torch.tensor([[[1.0, 1.0 + 1e-9]]], dtype=torch.float64)
    odd = torch.tensor([[[1.0 + 1e-9, 1.0]]], dtype=torch.float64)
    assert likeness(even, odd) == likeness(odd, even) == 1.0  # the same everywhere
