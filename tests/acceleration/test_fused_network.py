"""Logits and gradients, with respect to weights and images, equal those of torch."""

import pytest
import torch

from drone_rl.acceleration.fused_network import FusedNetwork
from drone_rl.acceleration.packed_layers import Reasons
from drone_rl.policies import MLP, OriginalCNN, SmallCNN
from drone_rl.policies.networks import InputsNetwork, InputsTrunk
from tests.policies.halves import draw_weights, forward_backward, halves, make_network


@pytest.fixture(autouse=True)
def same_numbers():
    """Random sums of halves are zero in one of some thousand draws, and would show nothing."""
    torch.manual_seed(0)


def assert_equal_torch(network, fused, count, shape):
    """Compare logits and gradients of random images; return torch's gradients."""
    images, weights = halves(count, *shape), halves(count, 3)
    logits, expected = forward_backward(network, network, images, weights)
    found, gradients = forward_backward(network, fused, images, weights)
    assert logits.any()
    torch.testing.assert_close(found, logits)
    for gradient, other in zip(gradients, expected, strict=True):
        torch.testing.assert_close(gradient, other, rtol=1e-5, atol=1e-5)
    return expected


@pytest.mark.parametrize("num_threads", [1, 2])
@pytest.mark.parametrize(
    ("shape", "options"),
    [
        ((1, 25, 64), {"channels": (8,), "hidden": ()}),
        ((1, 26, 41), {"patch": 5, "channels": (3, 17, 40), "hidden": (33, 20)}),
        ((1, 4, 4), {"channels": (5,), "hidden": (7,)}),  # output of 1x1
        ((3, 13, 22), {"channels": (5, 6)}),  # frames of three channels
        ((2, 8, 8), {"patch": 8, "channels": (4,)}),  # a patch is a whole frame
    ],
)
def test_gradients_equal_torch(shape, options, num_threads):
    network = make_network(shape, **options)
    fused = FusedNetwork.try_create(network, num_threads)
    for count in (150, 1, 2, 65):  # several blocks per thread; fewer than threads; smaller
        expected = assert_equal_torch(network, fused, count, shape)
        assert expected[0].any() or count < 3
        draw_weights(network)


@pytest.mark.parametrize("num_threads", [1, 2])
@pytest.mark.parametrize("pooled", [SmallCNN, OriginalCNN])
def test_gradients_of_several_inputs_and_of_a_critic_equal_torch(pooled, num_threads):
    shapes = {"goal": (3,), "gray": (2, 12, 20), "depth": (1, 17, 19), "altitude": (1,)}
    images = {"gray": SmallCNN((2, 12, 20), 3, channels=(5, 6)), "depth": pooled((1, 17, 19), 3)}
    network = InputsNetwork(shapes, images, 3, hidden=(9,))
    critic = torch.nn.Linear(9, 1)
    draw_weights(network)
    trunk, wanted = InputsTrunk(network), [*network.parameters(), *critic.parameters()]
    fused = FusedNetwork.try_create(network, num_threads, critic=critic)
    inputs, weights = [halves(70, *shape) for shape in shapes.values()], halves(70, 4)
    features = trunk(*inputs)
    expected = torch.cat([network.layers[-1](features), critic(features)], 1)
    found = fused(*inputs)
    torch.testing.assert_close(found, expected)
    gradients, others = (
        torch.autograd.grad((out * weights).sum(), wanted) for out in (found, expected)
    )
    for gradient, other in zip(gradients, others, strict=True):
        torch.testing.assert_close(gradient, other, rtol=1e-5, atol=1e-5)
    assert all(other.any() for other in others)


@pytest.mark.parametrize("num_threads", [1, 2])
@pytest.mark.parametrize(
    ("shape", "options"),
    [
        ((1, 25, 64), {"channels": (6, 7), "hidden": (20, 9)}),
        ((1, 17, 19), {"channels": (3,), "hidden": (5,)}),  # pooling drops a row and a column
        ((1, 16, 16), {"channels": (18, 4), "hidden": ()}),  # output of 1x1
    ],
)
def test_gradients_of_a_network_with_pooling_equal_torch(shape, options, num_threads):
    """Pixels are halves, so several outputs of a square are often equal."""
    network = OriginalCNN(shape, 3, **options)
    draw_weights(network)
    fused = FusedNetwork.try_create(network, num_threads)
    for count in (70, 1):
        expected = assert_equal_torch(network, fused, count, shape)
        assert all(gradient.any() for gradient in expected) or count == 1
        draw_weights(network)


@pytest.mark.filterwarnings("error")  # reading grad of a non-leaf image would warn
@pytest.mark.parametrize(
    ("shape", "options"),
    [
        ((1, 25, 64), {"hidden": (128,)}),
        ((1, 25, 64), {"channels": (5, 6, 7), "hidden": (9,)}),
        ((3, 13, 22), {"channels": (5,)}),
    ],
)
def test_gradients_of_images_equal_torch(shape, options):
    network = make_network(shape, **options)
    fused = FusedNetwork.try_create(network, wrt="pixels")
    images, weights = halves(70, *shape).requires_grad_(), halves(70, 3)
    expected, found = (
        torch.autograd.grad((by(images) * weights).sum(), images)[0] for by in (network, fused)
    )
    assert expected.any()
    torch.testing.assert_close(found, expected)
    assert all(p.grad is None for p in network.parameters())
    (fused(images * 1.0) * weights).sum().backward()
    assert all(p.grad is None for p in network.parameters())
    torch.testing.assert_close(images.grad, found)


def test_odd_patch_sizes_have_no_gradient_of_images():
    found = FusedNetwork.try_create(make_network((1, 26, 41), patch=5), wrt="pixels")
    assert found == ("the first layer's inputs are not a multiple of 16",)
    assert isinstance(FusedNetwork.try_create(make_network((1, 26, 41), patch=5)), FusedNetwork)


def test_batch_dimensions_and_no_grad():
    network = make_network()
    fused = FusedNetwork.try_create(network, 2)
    images = halves(2, 3, 1, 12, 20)
    with torch.no_grad():
        assert torch.allclose(fused(images), network(images), atol=1e-5)
        assert fused(images).shape == (2, 3, 3)


def test_gradients_are_deterministic():
    network, images, weights = make_network(), torch.randn(90, 1, 12, 20), torch.randn(90, 3)
    fused = FusedNetwork.try_create(network, 2)
    _, first = forward_backward(network, fused, images, weights)
    forward_backward(network, fused, torch.randn(200, 1, 12, 20), torch.randn(200, 3))
    _, again = forward_backward(network, fused, images, weights)
    assert all(torch.equal(one, other) for one, other in zip(first, again, strict=True))


def test_second_backward_pass_raises():
    network, images = make_network(), torch.randn(5, 1, 12, 20)
    fused = FusedNetwork.try_create(network, 1)
    total = fused(images).sum()
    total.backward(retain_graph=True)
    fused(images)  # overwrites the activations of the first call
    with pytest.raises(RuntimeError, match="second backward pass"):
        total.backward()


def test_two_forward_passes_before_backward_are_independent():
    network = make_network()
    fused = FusedNetwork.try_create(network, 2)
    batches = [halves(n, 1, 12, 20) for n in (40, 70)]
    expected = [forward_backward(network, network, b, torch.ones(len(b), 3))[1] for b in batches]
    fused(halves(90, 1, 12, 20)).sum().backward()  # leaves a buffer that only one call may reuse
    sums = [fused(batch).sum() for batch in batches]
    for total, other in zip(sums, expected, strict=True):
        network.zero_grad()
        total.backward()
        for p, gradient in zip(network.parameters(), other, strict=True):
            assert torch.allclose(p.grad, gradient, rtol=1e-3, atol=1e-3)


def test_network_for_images_keeps_its_initial_weights():
    network, images = make_network(), halves(5, 1, 12, 20)
    fused = FusedNetwork.try_create(network, wrt="pixels")
    first = fused(images)
    draw_weights(network)
    assert torch.equal(fused(images), first)
    assert not torch.equal(network(images), first)


def test_unsupported_networks_return_a_reason():
    for network, reason in (
        (MLP((1, 25, 64), 3), "network MLP is not fused"),
        (SmallCNN((1, 25, 64), 3, hidden=(600,)), "1082515 weights are more than 1048576"),
    ):
        found = FusedNetwork.try_create(network, 1)
        assert isinstance(found, Reasons) and found == (reason,)
    assert isinstance(
        FusedNetwork.try_create(SmallCNN((1, 25, 64), 3, hidden=(500,)), 1), FusedNetwork
    )
