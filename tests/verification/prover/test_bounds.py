"""Interval bounds by hand, and against every image that they are about."""

import itertools

import pytest
import torch
from torch import nn

from drone_rl.policies import OriginalCNN, SmallCNN
from drone_rl.utils.errors import InputError
from drone_rl.verification.prover.bounds import NetworkBounds, _step


class Linear(nn.Module):
    """Logits of an image of two pixels."""

    def __init__(self, weight, bias, *before):
        super().__init__()
        last = nn.Linear(2, len(weight))
        with torch.no_grad():
            last.weight.copy_(torch.tensor(weight))
            last.bias.copy_(torch.tensor(bias))
        self.layers = nn.Sequential(*before, nn.Flatten(), last)

    def forward(self, images):
        return self.layers(images)


def images(*pixels):
    return torch.tensor(pixels)[:, None, None].float()


def test_what_actions_have_in_common_cancels():
    """Both logits rise alike with the first pixel, so that it decides nothing."""
    bounds = NetworkBounds(Linear([[5.0, 1.0], [5.0, 0.0]], [0.0, 0.0]), gap=0.1)
    assert bounds.possible(images([-9, 0.2]), images([9, 1])).tolist() == [0b01]
    assert bounds.possible(images([-9, -1]), images([9, -0.2])).tolist() == [0b10]
    assert bounds.possible(images([-9, 0.05]), images([9, 1])).tolist() == [0b11]


def test_known_pictures_and_their_gap():
    bounds = NetworkBounds(Linear([[1.0, 0.0], [0.0, 1.0]], [0.0, 0.0]), gap=0.5)
    bits, gaps = bounds.decide(images([3, 1], [1, 1.2], [0, 2]))
    assert bits.tolist() == [0b01, 0b11, 0b10]
    assert gaps.tolist() == pytest.approx([2.0, 0.2, 2.0])


def test_a_third_action_is_left_out_where_another_beats_it():
    bounds = NetworkBounds(Linear([[1.0, 0.0], [0.0, 1.0], [0.0, 0.0]], [0.0, 0.0, -5.0]), gap=0.0)
    assert bounds.possible(images([0.0, 0.0]), images([1.0, 1.0])).tolist() == [0b011]


@pytest.mark.parametrize(("make", "doubt"), [(SmallCNN, 0.05), (OriginalCNN, 1e-3)])
def test_bounds_hold_for_all_that_they_are_about(make, doubt):
    """Two pixels in doubt and all mixtures of them: no action is taken that bounds excluded."""
    generator = torch.Generator().manual_seed(0)
    network = make((1, 25, 64), 3, generator=generator).eval()
    with torch.no_grad():
        network.layers[-1].weight.mul_(100)
        network.layers[-1].bias.copy_(torch.tensor([-1000.0, 0.0, 1000.0]))  # beyond rounding
    bounds = NetworkBounds(network, gap=1e-4)
    lower = torch.rand(40, 1, 25, 64, generator=generator)
    upper = lower.clone()
    upper[:, 0, 10, 30] += doubt
    upper[:, 0, 12, 31] += doubt
    possible = bounds.possible(lower.clone(), upper.clone())
    single = possible & (possible - 1) == 0
    assert single.any()  # else it says nothing
    for rows in itertools.product((False, True), repeat=2):
        mixed = lower.clone()
        mixed[:, 0, 10, 30] += doubt * rows[0]
        mixed[:, 0, 12, 31] += doubt * rows[1]
        bits, _ = bounds.decide(mixed)
        assert ((bits & ~possible) == 0).all()


def test_without_doubt_bounds_decide_like_the_network():
    generator = torch.Generator().manual_seed(1)
    network = SmallCNN((1, 25, 64), 3, generator=generator).eval()
    with torch.no_grad():
        network.layers[-1].weight.mul_(100)
        network.layers[-1].bias.copy_(torch.tensor([-1000.0, 0.0, 1000.0]))  # beyond rounding
    seen = torch.rand(50, 1, 25, 64, generator=generator)
    bounds = NetworkBounds(network, gap=1e-4)
    assert bounds.possible(seen.clone(), seen.clone()).tolist() == bounds.decide(seen)[0].tolist()
    assert bounds.decide(seen)[0].tolist() == (1 << network(seen).argmax(-1)).tolist()


def test_flattening_rounds_nothing():
    total, width = torch.tensor([[[2.0**24, 5.0]]]), torch.tensor([[[1.0, 2.0]]])
    step = _step(nn.Flatten(), 2)
    assert [v.tolist() for v in step(total, width)] == [[[2.0**24, 5.0]], [[1.0, 2.0]]]


def test_other_layers_are_refused():
    with pytest.raises(InputError, match="do not support the network's layer Tanh"):
        NetworkBounds(Linear([[1.0, 0.0]], [0.0], nn.Tanh()), gap=0.0)
    network = Linear([[1.0, 0.0]], [0.0])
    network.layers.append(nn.ReLU())
    with pytest.raises(InputError, match="last layer is not linear"):
        NetworkBounds(network, gap=0.0)


def test_probabilities_of_drawn_actions_by_hand():
    """Logits 0 and x with x from 1 to 2: the second is drawn with 1 / (1 + exp(-x))."""
    bounds = NetworkBounds(Linear([[0.0, 0.0], [1.0, 0.0]], [0.0, 0.0]), gap=0.0)
    least, most = bounds.probabilities(images([1.0, 0.0]), images([2.0, 0.0]))
    one, two = (1 / (1 + torch.tensor([-1.0, -2.0]).double().exp())).tolist()
    assert least[0].tolist() == pytest.approx([1 - two, one], rel=1e-5)
    assert most[0].tolist() == pytest.approx([1 - one, two], rel=1e-5)
    wider, _ = NetworkBounds(Linear([[0.0, 0.0], [1.0, 0.0]], [0.0, 0.0]), gap=0.5).probabilities(
        images([1.0, 0.0]), images([2.0, 0.0])
    )
    assert float(wider[0, 1]) == pytest.approx(1 / (1 + float(torch.tensor(-0.5).exp())))


def test_an_action_that_an_order_of_summation_decides_is_left_open():
    """The hidden unit is 2^24 + 1 - 2^24: 1 in exact arithmetic, 0 in some orders."""
    hidden = nn.Linear(2, 2)
    with torch.no_grad():
        hidden.weight.copy_(torch.tensor([[2.0**24, -(2.0**24)], [0.0, 0.0]]))
        hidden.bias.copy_(torch.tensor([1.0, 0.0]))
    network = Linear([[1.0, 0.0], [0.0, 0.0]], [0.0, 0.5], nn.Flatten(), hidden, nn.ReLU())
    bounds = NetworkBounds(network, gap=0.0)
    seen = images([1.0, 1.0])
    assert bounds.decide(seen)[0].tolist() == [0b11]
    assert bounds.possible(seen.clone(), seen.clone()).tolist() == [0b11]
    plain = Linear([[1.0, 0.0], [0.0, 0.0]], [0.0, 0.5])
    assert NetworkBounds(plain, gap=0.0).decide(seen)[0].tolist() == [0b01]
