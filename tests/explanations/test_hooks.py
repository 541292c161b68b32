import pytest
import torch

from drone_rl.explanations.hooks import (
    feature_layer,
    features,
    find_layer,
    layer_names,
    probabilities,
    spatial_layers,
)
from drone_rl.policies import MLP
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
    assert layer_names(mlp) == ["flatten", "fc1", "fc_relu1", "logits"]


def test_probabilities_add_up_to_one(world):
    torch.testing.assert_close(
        probabilities(world[2], torch.randn(5, 1, 25, 64)).sum(-1), torch.ones(5)
    )
