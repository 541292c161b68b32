"""Logits and gradients, with respect to weights and images, equal those of torch."""

import pytest
import torch

from drone_rl.acceleration.fused_network import ActivationCache, FusedNetwork
from drone_rl.acceleration.packed_layers import OutputOffsets, packed_layers
from drone_rl.policies import OriginalCNN
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
        ((1, 25, 64), {"hidden": (128,)}),
        ((1, 25, 64), {"channels": (8,), "hidden": ()}),
        ((1, 26, 41), {"patch": 5, "channels": (3, 17, 40), "hidden": (33, 20)}),
        ((1, 4, 4), {"channels": (5,), "hidden": (7,)}),  # output of 1x1
        ((1, 12, 40), {"channels": (6, 9), "hidden": (16,)}),  # output with one row
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
    [((1, 25, 64), {"hidden": (128,)}), ((1, 25, 64), {"channels": (5, 6, 7), "hidden": (9,)})],
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


@pytest.mark.parametrize(
    ("first", "last"),
    [
        (0, 70),
        (13, 58),  # some of the images, so row and image numbers differ
    ],
)
def test_gradients_from_cached_outputs_in_any_order_equal_torch(first, last):
    network = make_network((1, 12, 20), channels=(5, 6), hidden=(9, 7))
    check_cached_outputs(network, first, last)


def test_gradients_from_cached_outputs_of_pooling_equal_torch():
    network = OriginalCNN((1, 17, 20), 3, channels=(5, 6), hidden=(9,))
    draw_weights(network)
    check_cached_outputs(network, 13, 58)


def check_cached_outputs(network, first, last):
    shape = network.in_shape
    known = ActivationCache(100, OutputOffsets.of(packed_layers(network)).outputs[-1])
    fused = FusedNetwork.try_create(network, 2, cache=lambda: known)
    images, weights = halves(70, *shape), halves(last - first, 3)
    fused(images)  # packs the weights; nothing is cached yet
    engine = fused._engine
    outputs = engine.compute(images.flatten(1), None).outputs.view(-1, known.outputs.shape[1])
    rows = torch.randperm(100)[:70]
    known.clear()
    known.outputs.fill_(3.0)  # any other row would give wrong gradients
    known.outputs[rows] = outputs[:70]
    handles = known.add(rows, engine._weights.clone(), images)[first:last]
    some = images[first:last]
    assert known.find(handles, engine._weights, some) is not None
    logits, expected = forward_backward(network, network, some, weights)
    found, gradients = forward_backward(network, lambda x: fused(x, handles), some, weights)
    torch.testing.assert_close(found, logits)
    for gradient, other in zip(gradients, expected, strict=True):
        assert other.any()
        torch.testing.assert_close(gradient, other, rtol=1e-5, atol=1e-5)
