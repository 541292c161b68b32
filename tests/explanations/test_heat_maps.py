import math

import pytest
import torch

from drone_rl.explanations.heat_maps import Explainer
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


def test_grad_cam_of_two_by_two_maps_by_hand():
    activations = torch.tensor([[[[1.0, 2.0], [0.0, 4.0]], [[1.0, 1.0], [2.0, 0.0]]]])
    gradients = torch.tensor([[[[1.0, 1.0], [1.0, 1.0]], [[-2.0, -2.0], [-2.0, -2.0]]]])
    # weights 1 and -2: 1 - 2, 2 - 2, 0 - 4, 4 - 0, then ReLU
    assert grad_cam(activations, gradients).tolist() == [[[0.0, 0.0], [0.0, 4.0]]]


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
    torch.testing.assert_close(explainer.grad_cam(x, actions, objective), expected)


def test_all_methods_give_maps_of_the_pictures_size_and_leave_no_hook(explainer, frames):
    network = explainer.network
    for name, method in explainer.methods().items():
        maps = method(*frames)
        assert maps.shape == (6, 25, 64), name
        assert (maps >= 0).all() and torch.isfinite(maps).all()
    assert sum(len(m._forward_hooks) + len(m._backward_hooks) for m in network.modules()) == 0
    assert all(p.grad is None for p in network.parameters())


def test_what_has_no_gradients_has_but_occlusion(explainer, frames):
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


def test_integrated_gradients_add_up_to_the_change_of_a_linear_policy():
    network = MLP((1, 2, 2), 2, hidden=())
    explainer = Explainer(network, torch.zeros(1, 2, 2))
    explainer._forward = lambda *_: network  # a linear function: the sum is exact
    x = torch.rand(1, 1, 2, 2)
    maps = explainer.integrated_gradients(x, torch.tensor([1]))
    expected = (x[0, 0] * network.layers.logits.weight[1].view(2, 2)).abs().detach()
    torch.testing.assert_close(maps[0], expected)


def test_a_policy_without_convolutions_has_the_other_methods():
    explainer = Explainer(MLP((1, 8, 8), 3), torch.zeros(1, 8, 8))
    assert "grad_cam" not in explainer.methods()
    assert explainer.methods()["occlusion"](torch.rand(2, 1, 8, 8), torch.tensor([0, 1])).any()
    with pytest.raises(InputError, match="needs a convolution"):
        explainer.grad_cam(torch.rand(2, 1, 8, 8), torch.tensor([0, 1]))


def test_a_layer_without_a_feature_map_is_refused(world):
    with pytest.raises(InputError, match=r"layer=fc1 has no feature map; those that do: relu1"):
        Explainer(world[2], torch.zeros(1, 25, 64), "fc1")
    with pytest.raises(InputError, match=r"layer=nope is not in the policy"):
        Explainer(world[2], torch.zeros(1, 25, 64), "nope")


def test_integrated_gradients_add_up_to_the_change_in_probability(explainer, frames):
    assert explainer.completeness_error(*frames).max() < 1e-3


def test_the_completeness_error_is_what_a_coarse_integral_misses(monkeypatch):
    network = MLP((1, 1, 1), 2, hidden=())
    with torch.no_grad():
        network.layers.logits.weight.copy_(torch.tensor([[0.0], [8.0]]))
        network.layers.logits.bias.copy_(torch.tensor([0.0, -4.0]))
    explainer = Explainer(network, torch.zeros(1, 1, 1))
    x, a = torch.ones(1, 1, 1, 1), torch.tensor([1])
    assert explainer.completeness_error(x, a).item() < 1e-3
    monkeypatch.setattr("drone_rl.explanations.heat_maps.INTEGRATION_STEPS", 2)
    # two steps, at odds of e^-2 and e^2, where the derivative is 8 p (1 - p); all from e^-4 to e^4
    p, all_of_it = 1 / (1 + math.exp(-2)), math.tanh(2)
    expected = all_of_it - 8 * p * (1 - p)
    assert explainer.completeness_error(x, a).item() == pytest.approx(expected, abs=1e-5)


def test_channels_that_cancel_out_leave_no_integrated_gradient():
    network = MLP((2, 1, 1), 2, hidden=())
    with torch.no_grad():
        network.layers.logits.weight.copy_(torch.tensor([[0.0, 0.0], [1.0, -1.0]]))
    explainer = Explainer(network, torch.zeros(2, 1, 1))
    x, a = torch.ones(1, 2, 1, 1), torch.tensor([1])
    assert explainer.integrated_gradients(x, a).item() == pytest.approx(0.0, abs=1e-7)
    assert explainer.saliency(x, a).item() == pytest.approx(0.5)  # two derivatives of 1/4


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
