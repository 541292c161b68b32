"""Heat maps, and the layers of networks."""

import pytest
import torch
from torch import nn

from drone_rl.explanations.heat_maps import Explainer
from drone_rl.explanations.hooks import (
    feature_layer,
    features,
    find_layer,
    layers,
    spatial_layers,
)
from drone_rl.policies import MLP, ExternalNetwork
from drone_rl.sim.actions import MOVES
from drone_rl.utils.errors import InputError


def grad_cam(activations, gradients):
    """Eqs. 19 and 20 as written: feature maps weighted by their mean gradients, ReLU."""
    return (gradients.mean((2, 3), keepdim=True) * activations).sum(1).relu()


@pytest.fixture
def explainer(world, dataset):
    return Explainer(world[2], dataset.tensor("observations").mean(0))


@pytest.fixture
def frames(dataset):
    return dataset.tensor("observations")[:6], dataset.tensor("actions")[:6]


@pytest.mark.parametrize("objective", ["probability", "logit"])
def test_grad_cam_against_written_out_derivatives(explainer, frames, objective):
    x, actions = frames
    layers = explainer.network.layers
    activations = layers.relu1(layers.conv1(x))
    logits = layers.logits(layers.fc_relu1(layers.fc1(layers.flatten(activations))))
    value = logits.softmax(-1) if objective == "probability" else logits
    (gradients,) = torch.autograd.grad(value.gather(1, actions[:, None]).sum(), activations)
    coarse = grad_cam(activations, gradients).detach()
    expected = torch.nn.functional.interpolate(coarse[:, None], (25, 64), mode="bilinear")[:, 0]
    torch.testing.assert_close(explainer.grad_cam(x, actions, objective=objective), expected)


def test_maps_have_the_size_of_observations_and_leave_no_hook(explainer, frames):
    network = explainer.network
    for name, method in explainer.methods().items():
        maps = method(*frames)
        assert maps.shape == (6, 25, 64), name
        assert (maps >= 0).all() and torch.isfinite(maps).all()
    assert sum(len(m._forward_hooks) + len(m._backward_hooks) for m in network.modules()) == 0
    assert all(p.grad is None for p in network.parameters())


def test_without_gradients_only_occlusion_is_left(explainer, frames):
    network = ExternalNetwork(torch.no_grad()(explainer.network), (1, 25, 64), MOVES)
    other = Explainer(network, explainer.absent)
    assert list(other.methods()) == ["occlusion"]
    torch.testing.assert_close(other.occlusion(*frames), explainer.occlusion(*frames))
    with pytest.raises(InputError, match=r"^Grad-CAM needs a convolution"):
        other.grad_cam(*frames)
    whole = ExternalNetwork(explainer.network, (1, 25, 64), MOVES)
    same = Explainer(whole, explainer.absent)
    assert same.layer == "layers.relu1"
    for name, method in same.methods().items():
        torch.testing.assert_close(method(*frames), explainer.methods()[name](*frames))


def test_integrated_gradients_of_a_linear_policy():
    network = MLP((1, 2, 2), 2, hidden=())
    explainer = Explainer(network, torch.zeros(1, 2, 2))
    explainer._forward = lambda *_: network  # a linear function: the sum is exact
    x = torch.rand(1, 1, 2, 2)
    maps = explainer.integrated_gradients(x, torch.tensor([1]))
    expected = (x[0, 0] * network.layers.logits.weight[1].view(2, 2)).abs().detach()
    torch.testing.assert_close(maps[0], expected)


def test_a_layer_without_a_feature_map_is_refused(world):
    with pytest.raises(InputError, match=r"layer=fc1 has no feature map; those that do: relu1"):
        Explainer(world[2], torch.zeros(1, 25, 64), "fc1")
    with pytest.raises(InputError, match=r"layer=nope is not in the policy"):
        Explainer(world[2], torch.zeros(1, 25, 64), "nope")


def test_occlusion_by_hand():
    network = MLP((1, 3, 6), 2, hidden=())
    with torch.no_grad():
        network.layers.logits.weight.zero_()
        network.layers.logits.weight[1, 0] = 2.0  # the pixel in the corner
    x = torch.ones(1, 1, 3, 6)
    explainer = Explainer(network, torch.zeros(1, 3, 6))
    found = explainer.occlusion(x, torch.tensor([1]))[0]
    change = torch.sigmoid(torch.tensor(2.0)) - 0.5
    # patches of 3x3 begin at columns 0, 1, 2 and 3; the first alone holds the corner
    expected = change * torch.tensor([1, 1 / 2, 1 / 3, 0, 0, 0])
    torch.testing.assert_close(found, expected.expand(3, 6))
    assert explainer.occlusion(torch.zeros(1, 1, 3, 6), torch.tensor([1])).max() == 0


def num_hooks(network):
    return sum(len(m._forward_hooks) + len(m._backward_hooks) for m in network.modules())


def test_layers_of_networks_with_and_without_convolutions(world):
    assert spatial_layers(world[2]) == ["relu1"]
    assert feature_layer(world[2]) == "fc_relu1"
    mlp = MLP((1, 4, 4), 3, hidden=(5,))
    assert spatial_layers(mlp) == []
    assert [*layers(mlp)] == ["flatten", "fc1", "fc_relu1", "logits"]


class ThirdParty(nn.Module):
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
def third_party():
    return ExternalNetwork(ThirdParty(), (1, 8, 10), MOVES)


def test_layers_of_third_party_networks_are_in_the_order_of_the_forward_pass(third_party):
    assert [*layers(third_party)] == ["body.0", "body.1", "body.2", "head.before", "head.last"]
    assert spatial_layers(third_party) == ["body.1", "body.2"]  # what follows the second acts twice
    assert feature_layer(third_party) == "head.before"
    assert num_hooks(third_party) == 0
    x = torch.randn(5, 1, 8, 10)
    body = third_party.parts.body
    torch.testing.assert_close(features(third_party, x, "body.1"), body[1](body[0](x)))


def test_a_function_has_no_layers():
    network = ExternalNetwork(lambda x: x.flatten(1)[:, :3], (1, 8, 10), MOVES)
    assert ([*layers(network)], spatial_layers(network), feature_layer(network)) == ([], [], None)
    with pytest.raises(InputError, match="from: none"):
        find_layer(network, "conv1")
    one = ExternalNetwork(nn.Sequential(nn.Flatten(), nn.Linear(80, 3)), (1, 8, 10), MOVES)
    assert feature_layer(one) == "0"
