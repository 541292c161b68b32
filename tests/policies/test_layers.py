import pytest
import torch
from torch import nn

from drone_rl.policies import MLP, OriginalCNN
from drone_rl.policies.layers import Unsupported, as_layers
from tests.own_networks import Doubled, Mirrored, network_of


def test_branch_and_trunk():
    network = OriginalCNN((1, 25, 64), 3, hidden=(5,))
    ((key, in_shape, layers),), trunk = as_layers(network)
    assert (key, in_shape) == ("pixels", (1, 25, 64))
    names = ["Conv2d", "ReLU", "MaxPool2d"]
    assert [type(layer).__name__ for layer in layers] == [*names, *names, "Flatten"]
    assert [type(layer).__name__ for layer in trunk] == ["Linear", "ReLU", "Linear"]
    pixels = torch.rand(2, 1, 25, 64)
    assert torch.equal(nn.Sequential(*as_layers(network).in_turn)(pixels), network(pixels))


@pytest.mark.parametrize(
    ("first", "features"),
    [
        (nn.Conv2d(1, 2, 3, padding=1), 128),
        (nn.Conv2d(1, 2, 3, dilation=2), 32),
        (nn.Conv2d(1, 2, 3, bias=False), 72),
        (nn.MaxPool2d(3, 1), 36),
        (nn.MaxPool2d(3, ceil_mode=True), 9),
        (nn.Tanh(), 64),
        (nn.Flatten(2), 64),
        (Doubled(1, 2, 3), 72),
        (nn.utils.parametrizations.spectral_norm(nn.Conv2d(1, 2, 3)), 72),
    ],
)
def test_other_layers_are_named(first, features):
    found = as_layers(network_of(first, nn.ReLU(), nn.Flatten(), nn.Linear(features, 3)))
    assert isinstance(found, Unsupported)
    assert found.reason == f"network PolicyNetwork has the layer {first}"


def test_other_networks():
    own, other = Mirrored((1, 25, 64), 3), nn.Linear(2, 3)
    assert as_layers(own).reason == "network Mirrored overrides forward"
    assert as_layers(other).reason == "network Linear is no PolicyNetwork"
    end = as_layers(network_of(nn.Flatten(), nn.Linear(64, 3), nn.ReLU()))
    assert "does not end in" in end.reason
    assert not isinstance(as_layers(MLP((1, 25, 64), 3)), Unsupported)
