"""Supported networks, and the backward pass of the fused network."""

import copy

import pytest
import torch

from drone_rl.acceleration.fused_network import ActivationCache, FusedNetwork
from drone_rl.envs.direct_renderer import Reasons
from drone_rl.policies import MLP, SmallCNN
from drone_rl.utils.errors import InputError
from tests.policies.halves import draw_weights, forward_backward, halves, make_network


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


def test_copies_are_independent():
    network = make_network()
    fused = FusedNetwork.try_create(network, 1)
    other = copy.deepcopy(fused)
    with torch.no_grad():
        network.layers.logits.bias += 1.0
    images = halves(3, 1, 12, 20)
    assert torch.allclose(fused(images) - other(images), torch.ones(3, 3), atol=1e-5)


def test_images_of_another_shape_raise():
    fused = FusedNetwork.try_create(make_network())
    assert fused.in_shape == (1, 12, 20) and fused.num_actions == 3
    with pytest.raises(InputError, match="built for images"):
        fused(halves(5, 1, 12, 21))


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
        (SmallCNN((2, 25, 64), 3), "a network of 2 channels is not fused"),
        (SmallCNN((1, 25, 64), 3, hidden=(600,)), "1082515 weights are more than 1048576"),
    ):
        found = FusedNetwork.try_create(network, 1)
        assert isinstance(found, Reasons) and found == (reason,)
    assert isinstance(
        FusedNetwork.try_create(SmallCNN((1, 25, 64), 3, hidden=(500,)), 1), FusedNetwork
    )


WEIGHTS = torch.tensor([1.0, -2.0])


def seen(rows=(6, 0, 1, 7)):
    """Return observations of these rows with distinct values."""
    return torch.arange(8.0)[list(rows), None].expand(-1, 40) + torch.arange(40.0) / 64


def filled(rows=(6, 0, 1, 7)):
    cache = ActivationCache(8, 3)
    cache.clear()
    return cache, cache.add(torch.tensor(rows), WEIGHTS, seen(rows))


def test_handles_find_the_rows_of_activations():
    cache, handles = filled()
    assert cache.outputs.shape == (8, 3)
    assert cache.find(handles, WEIGHTS.clone(), seen()).tolist() == [6, 0, 1, 7]
    assert cache.find(handles[1:3], WEIGHTS, seen()[1:3]).tolist() == [0, 1]
    assert cache.find(handles, WEIGHTS, seen()).dtype == torch.int32


def test_handles_are_invalid_for_changed_observations():
    cache, handles = filled()
    assert cache.find(handles, WEIGHTS, seen() + 2.0**-10) is None
    assert cache.find(handles, WEIGHTS, seen().flip(0)) is None
    assert cache.find(handles, WEIGHTS, seen().roll(1, 1)) is None


def test_handles_are_invalid_for_other_weights():
    cache, handles = filled()
    assert cache.find(handles, torch.tensor([1.0, -2.0000002]), seen()) is None


def test_handles_are_valid_until_the_cache_is_cleared():
    cache, handles = filled()
    cache.clear()
    assert cache.find(handles, WEIGHTS, seen()) is None
    other = cache.add(torch.tensor([6, 0]), WEIGHTS, seen((6, 0)))
    assert cache.find(other, WEIGHTS, seen((6, 0))).tolist() == [6, 0]
    assert (
        cache.find(torch.cat([other, handles]), WEIGHTS, torch.cat([seen((6, 0)), seen()])) is None
    )
    assert ActivationCache(8, 3).find(handles, WEIGHTS, seen()) is None


def test_handles_are_invalid_if_not_all_activations_fit():
    for last, fits in ((7, True), (8, False)):
        cache, handles = filled((0, min(last, 7)))
        handles = cache.add(torch.tensor((0, last)), WEIGHTS, seen((0, 7)))
        assert (cache.find(handles, WEIGHTS, seen((0, 7))) is not None) is fits
