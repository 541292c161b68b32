import pytest
import torch
from torch import nn

from drone_rl.explanations.hooks import (
    feature_layer,
    features,
    find_layer,
    layers,
    probabilities,
    spatial_layers,
)
from drone_rl.policies import MLP, ExternalNetwork
from drone_rl.sim.actions import MOVES
from drone_rl.utils.errors import InputError


def num_hooks(network):
    return sum(len(m._forward_hooks) + len(m._backward_hooks) for m in network.modules())


def test_features_are_what_the_layers_make(world):
    network, x = world[2], torch.randn(5, 1, 25, 64)
    found = features(network, x, "relu1")
    torch.testing.assert_close(found, network.layers.conv1(x).relu())
    assert num_hooks(network) == 0


def test_no_hook_survives_an_error(world):
    with pytest.raises(InputError):
        features(world[2], torch.randn(5, 1, 9, 9), "relu1")
    assert num_hooks(world[2]) == 0


def test_unknown_layer_lists_those_that_exist(world):
    with pytest.raises(InputError, match=r"layer=conv9 .* choose from: conv1, relu1, flatten"):
        find_layer(world[2], "conv9")


def test_layers_of_networks_with_and_without_convolutions(world):
    assert spatial_layers(world[2]) == ["relu1"]
    assert feature_layer(world[2]) == "fc_relu1"
    mlp = MLP((1, 4, 4), 3, hidden=(5,))
    assert spatial_layers(mlp) == []
    assert [*layers(mlp)] == ["flatten", "fc1", "fc_relu1", "logits"]


def test_probabilities_add_up_to_one(world):
    torch.testing.assert_close(
        probabilities(world[2], torch.randn(5, 1, 25, 64)).sum(-1), torch.ones(5)
    )


class Elsewhere(nn.Module):
    """Layers in modules of modules, one twice, one never, and one whose output is no tensor."""

    def __init__(self):
        super().__init__()
        self.head = nn.ModuleDict({"last": nn.Linear(6, 3), "before": nn.Linear(40, 6)})
        self.body = nn.Sequential(nn.Conv2d(1, 2, 3, padding=1), nn.ReLU(), nn.Conv2d(2, 2, 2, 2))
        self.nothing = nn.Sequential()
        self.twice, self.never, self.memory = nn.Tanh(), nn.Linear(1, 1), nn.LSTM(1, 1)

    def forward(self, x):
        self.memory(x.new_zeros(1, 1))
        x = self.nothing(self.twice(self.body(x)).flatten(1))
        return self.twice(self.head["last"](self.head["before"](x)))


@pytest.fixture
def elsewhere():
    return ExternalNetwork(Elsewhere(), (1, 8, 10), MOVES)


def test_layers_from_elsewhere_stand_in_the_order_in_which_they_act(elsewhere):
    assert [*layers(elsewhere)] == ["body.0", "body.1", "body.2", "head.before", "head.last"]
    assert spatial_layers(elsewhere) == ["body.1", "body.2"]  # what follows the second acts twice
    assert feature_layer(elsewhere) == "head.before"
    assert num_hooks(elsewhere) == 0
    x = torch.randn(5, 1, 8, 10)
    body = elsewhere.parts.body
    torch.testing.assert_close(features(elsewhere, x, "body.1"), body[1](body[0](x)))


@pytest.mark.parametrize("name", ["head", "", "body", "twice", "never", "memory"])
def test_what_is_no_layer(elsewhere, name):
    with pytest.raises(InputError, match=r"choose from: body\.0, body\.1, .*, head\.last$"):
        find_layer(elsewhere, name)


def test_a_function_has_no_layers():
    network = ExternalNetwork(lambda x: x.flatten(1)[:, :3], (1, 8, 10), MOVES)
    assert ([*layers(network)], spatial_layers(network), feature_layer(network)) == ([], [], None)
    with pytest.raises(InputError, match="from: none, because it is no torch module"):
        find_layer(network, "conv1")
    one = ExternalNetwork(nn.Sequential(nn.Flatten(), nn.Linear(80, 3)), (1, 8, 10), MOVES)
    assert feature_layer(one) == "0"


class Last(nn.Module):
    """A convolution whose numbers are the logits, beside a layer that sums over pictures."""

    def __init__(self):
        super().__init__()
        self.conv = nn.Conv2d(1, 3, (8, 10))
        self.over = Over()

    def forward(self, x):
        return self.over(x) * 0.0 + self.conv(x).flatten(1)


class Over(nn.Module):
    def forward(self, x):
        return x.sum((0, 1, 2, 3)).view(1, 1)


class TwoConvolutions(nn.Module):
    """Convolutions of one shape, with an activation that is a function."""

    def __init__(self):
        super().__init__()
        self.a, self.b = nn.Conv2d(1, 2, 3, padding=1), nn.Conv2d(2, 2, 3, padding=1)
        self.last = nn.Linear(160, 3)

    def forward(self, x):
        return self.last(self.b(self.a(x).relu()).relu().flatten(1))


def test_a_convolution_after_another_one_is_a_layer_of_its_own():
    network = ExternalNetwork(TwoConvolutions(), (1, 8, 10), MOVES)
    assert spatial_layers(network) == ["a", "b"]


def test_a_convolution_may_be_the_last_and_what_is_of_no_picture_is_no_layer():
    network = ExternalNetwork(Last(), (1, 8, 10), MOVES)
    assert [*layers(network)] == ["conv"]
    assert spatial_layers(network) == ["conv"] and feature_layer(network) is None
