"""What it takes and refuses, and that there is no second way back."""

import copy

import pytest
import torch

from drone_rl.acceleration.fused_network import FusedNetwork
from drone_rl.policies import MLP, OriginalCNN, SmallCNN
from drone_rl.utils.errors import InputError
from tests.policies.halves import draw_weights, halves, made, taught


def test_patches_of_an_odd_size_have_no_way_back_to_pictures():
    assert FusedNetwork.find(made((1, 26, 41), patch=5), of="pictures") is None
    assert FusedNetwork.find(made((1, 26, 41), patch=5), of="weights") is not None


def test_more_dimensions_and_no_gradient():
    network = made()
    learning = FusedNetwork.find(network, 2)
    pictures = halves(2, 3, 1, 12, 20)
    with torch.no_grad():
        assert torch.allclose(learning(pictures), network(pictures), atol=1e-5)
        assert learning(pictures).shape == (2, 3, 3)


def test_the_same_every_time():
    network, pictures, weights = made(), torch.randn(90, 1, 12, 20), torch.randn(90, 3)
    learning = FusedNetwork.find(network, 2)
    _, first = taught(network, learning, pictures, weights)
    taught(network, learning, torch.randn(200, 1, 12, 20), torch.randn(200, 3))
    _, again = taught(network, learning, pictures, weights)
    assert all(torch.equal(one, other) for one, other in zip(first, again, strict=True))


def test_there_is_no_second_way_back():
    network, pictures = made(), torch.randn(5, 1, 12, 20)
    learning = FusedNetwork.find(network, 1)
    total = learning(pictures).sum()
    total.backward(retain_graph=True)
    learning(pictures)  # works where the first numbers were
    with pytest.raises(RuntimeError, match="once"):
        total.backward()


def test_two_ways_at_a_time_do_not_meet():
    network = made()
    learning = FusedNetwork.find(network, 2)
    batches = [halves(n, 1, 12, 20) for n in (40, 70)]
    expected = [taught(network, network, b, torch.ones(len(b), 3))[1] for b in batches]
    learning(halves(90, 1, 12, 20)).sum().backward()  # leaves numbers that only one may have
    sums = [learning(batch).sum() for batch in batches]
    for total, other in zip(sums, expected, strict=True):
        network.zero_grad()
        total.backward()
        for p, gradient in zip(network.parameters(), other, strict=True):
            assert torch.allclose(p.grad, gradient, rtol=1e-3, atol=1e-3)


def test_a_copy_learns_by_itself():
    network = made()
    learning = FusedNetwork.find(network, 1)
    other = copy.deepcopy(learning)
    with torch.no_grad():
        network.layers.logits.bias += 1.0
    pictures = torch.randn(3, 1, 12, 20)
    assert torch.allclose(learning(pictures) - other(pictures), torch.ones(3, 3), atol=1e-5)


def test_pictures_of_another_shape_are_refused():
    learning = FusedNetwork.find(made())
    assert learning.in_shape == (1, 12, 20) and learning.num_actions == 3
    with pytest.raises(InputError, match="built for pictures"):
        learning(halves(5, 1, 12, 21))


def test_pictures_meet_the_weights_that_were_there_at_first():
    network, pictures = made(), halves(5, 1, 12, 20)
    learning = FusedNetwork.find(network, of="pictures")
    first = learning(pictures)
    draw_weights(network)
    assert torch.equal(learning(pictures), first)
    assert not torch.equal(network(pictures), first)


def test_only_what_the_kernel_knows():
    assert FusedNetwork.find(MLP((1, 25, 64), 3), 1) is None
    assert FusedNetwork.find(OriginalCNN((1, 25, 64), 3), 1) is None
    assert FusedNetwork.find(SmallCNN((2, 25, 64), 3), 1) is None
    assert FusedNetwork.find(SmallCNN((1, 25, 64), 3, hidden=(500,)), 1) is not None
    assert FusedNetwork.find(SmallCNN((1, 25, 64), 3, hidden=(600,)), 1) is None  # too many
