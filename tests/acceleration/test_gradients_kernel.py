"""Logits and gradients are those of torch, by weights and by pictures."""

import pytest
import torch

from drone_rl.acceleration.fused_network import ActivationCache, FusedNetwork
from drone_rl.acceleration.packed_layers import outputs_at, packed_layers
from tests.policies.halves import draw_weights, halves, made, taught


@pytest.mark.parametrize("num_threads", [1, 2])
@pytest.mark.parametrize(
    ("shape", "options"),
    [
        ((1, 25, 64), {"hidden": (128,)}),
        ((1, 25, 64), {"channels": (8,), "hidden": ()}),
        ((1, 26, 41), {"patch": 5, "channels": (3, 17, 40), "hidden": (33, 20)}),
        ((1, 4, 4), {"channels": (5,), "hidden": (7,)}),  # one place is left
        ((1, 12, 40), {"channels": (6, 9), "hidden": (16,)}),  # one row is left
    ],
)
def test_gradients_are_torchs(shape, options, num_threads):
    network = made(shape, **options)
    learning = FusedNetwork.try_create(network, num_threads)
    for count in (150, 1, 2, 65):  # more than a block a thread; fewer than threads; smaller ones
        pictures, weights = halves(count, *shape), halves(count, 3)
        logits, expected = taught(network, network, pictures, weights)
        found, gradients = taught(network, learning, pictures, weights)
        assert logits.any()
        torch.testing.assert_close(found, logits)
        for gradient, other in zip(gradients, expected, strict=True):
            torch.testing.assert_close(gradient, other, rtol=1e-5, atol=1e-5)
        assert expected[0].any() or count < 3
        draw_weights(network)


@pytest.mark.filterwarnings("error")  # pictures that are made of others have no gradient to give
@pytest.mark.parametrize(
    ("shape", "options"),
    [((1, 25, 64), {"hidden": (128,)}), ((1, 25, 64), {"channels": (5, 6, 7), "hidden": (9,)})],
)
def test_gradients_of_pictures_are_torchs(shape, options):
    network = made(shape, **options)
    learning = FusedNetwork.try_create(network, of="pixels")
    pictures, weights = halves(70, *shape).requires_grad_(), halves(70, 3)
    expected, found = (
        torch.autograd.grad((by(pictures) * weights).sum(), pictures)[0]
        for by in (network, learning)
    )
    assert expected.any()
    torch.testing.assert_close(found, expected)
    assert all(p.grad is None for p in network.parameters())
    (learning(pictures * 1.0) * weights).sum().backward()
    assert all(p.grad is None for p in network.parameters())
    torch.testing.assert_close(pictures.grad, found)


@pytest.mark.parametrize(
    ("first", "last"),
    [
        (0, 70),
        (13, 58),  # some of the pictures, so that no row is that of its picture
    ],
)
def test_gradients_from_known_outputs_in_any_order_are_torchs(first, last):
    network = made((1, 12, 20), channels=(5, 6), hidden=(9, 7))
    known = ActivationCache(100, outputs_at(packed_layers(network))[-1])
    learning = FusedNetwork.try_create(network, 2, cache=lambda: known)
    pictures, weights = halves(70, 1, 12, 20), halves(last - first, 3)
    learning(pictures)  # packs the weights; nothing is cached yet
    work = learning._work
    outputs = work.compute(pictures.flatten(1), None).outputs.view(-1, known.outputs.shape[1])
    rows = torch.randperm(100)[:70]
    known.clear()
    known.outputs.fill_(3.0)  # wrong wherever another row is read
    known.outputs[rows] = outputs[:70]
    handles = known.add(rows, work._weights.clone(), pictures)[first:last]
    some = pictures[first:last]
    assert known.find(handles, work._weights, some) is not None
    logits, expected = taught(network, network, some, weights)
    found, gradients = taught(network, lambda x: learning(x, handles), some, weights)
    torch.testing.assert_close(found, logits)
    for gradient, other in zip(gradients, expected, strict=True):
        assert other.any()
        torch.testing.assert_close(gradient, other, rtol=1e-5, atol=1e-5)
