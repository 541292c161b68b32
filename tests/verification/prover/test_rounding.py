import numpy as np
import pytest
import torch
from torch import nn

from drone_rl.policies import MLP, OriginalCNN, SmallCNN
from drone_rl.verification.prover.rounded_layers import rounded
from drone_rl.verification.prover.rounding import RoundingBound
from tests.own_networks import Mirrored

BIG = 2.0**24


def in_some_order(weight, bias, value, random, is_fused):
    """Evaluate a linear layer in float32 with terms added in a random order."""
    made = np.empty(len(weight), np.float32)
    for out, row in enumerate(weight):
        order = random.permutation(len(row) + 1)
        total = np.float32(0)
        for term in order:
            if term == len(row):
                total = np.float32(total + bias[out])
            elif is_fused:  # the product is not rounded
                total = np.float32(float(total) + float(row[term]) * float(value[term]))
            else:
                total = np.float32(total + np.float32(row[term] * value[term]))
        made[out] = total
    return made


def mlp(seed, hidden=(12, 9), spread=1.0):
    generator = torch.Generator().manual_seed(seed)
    network = MLP((1, 3, 4), 3, hidden=hidden, generator=generator)
    with torch.no_grad():
        for parameter in network.parameters():
            parameter.copy_(torch.randn(parameter.shape, generator=generator) * spread)
            parameter *= 10 ** torch.randn(parameter.shape, generator=generator)
    return network


@pytest.mark.parametrize("seed", range(6))
def test_no_order_of_summation_exceeds_the_bounds(seed):
    network, random = mlp(seed), np.random.default_rng(seed)
    pixels = torch.randn(4, 1, 3, 4, generator=torch.Generator().manual_seed(seed))
    bound = RoundingBound.find(network)
    exact = network.double()(pixels.double())
    network.float()
    each, (_, together) = bound.errors(pixels), bound.together(pixels)
    layers = [layer for layer in network.layers if isinstance(layer, nn.Linear)]
    worst = torch.zeros_like(exact)
    for trial in range(30):
        for row, image in enumerate(pixels.flatten(1).numpy()):
            value = image
            for layer in layers:
                parameters = layer.weight.detach().numpy(), layer.bias.detach().numpy()
                value = in_some_order(*parameters, value, random, trial % 2 == 0)
                value = value if layer is layers[-1] else value.clip(min=0)
            off = (torch.from_numpy(value).double() - exact[row]).abs()
            worst[row] = torch.maximum(worst[row], off)
    assert (worst <= each).all()
    assert (worst <= together).all()
    assert (each <= together * 1.01).all()
    assert (worst > each / 1000).any()  # the bound is not too loose


@pytest.mark.parametrize("make", [SmallCNN, OriginalCNN])
def test_bounds_of_convolutions_hold_for_float32_and_are_close(make):
    network = make((1, 25, 64), 3, generator=torch.Generator().manual_seed(0))
    pixels = torch.randn(5, 1, 25, 64, generator=torch.Generator().manual_seed(1))
    bound = RoundingBound.find(network)
    with torch.no_grad():
        rounded = network(pixels).double()
        exact = network.double()(pixels.double())
    each = bound.errors(pixels)
    assert ((rounded - exact).abs() <= each).all()
    assert (each < 0.01 * exact.abs().max()).all()


def test_summation_orders_that_change_the_action_are_found():
    """The hidden unit is 2^24 + 1 - 2^24; it decides between the first and second action."""
    network = MLP((1, 1, 2), 2, hidden=(1,))
    with torch.no_grad():
        network.layers.get_parameter("fc1.weight").copy_(torch.tensor([[BIG, -BIG]]))
        network.layers.get_parameter("fc1.bias").fill_(1.0)
        network.layers.get_parameter("logits.weight").copy_(torch.tensor([[1.0], [0.0]]))
        network.layers.get_parameter("logits.bias").copy_(torch.tensor([0.0, 0.5]))
    bound = RoundingBound.find(network)
    _, possible = bound.decide(torch.tensor([[1.0, 1.0], [1.0, 0.5]]).view(2, 1, 1, 2))
    assert possible.tolist() == [[True, True], [True, False]]


def test_sums_that_may_overflow_decide_nothing():
    network = MLP((1, 1, 2), 2, hidden=(1,))
    with torch.no_grad():
        network.layers.get_parameter("fc1.weight").copy_(torch.tensor([[3e38, -3e38]]))
        network.layers.get_parameter("logits.bias").copy_(torch.tensor([0.0, 9.0]))
    pixels = torch.ones(1, 1, 1, 2)
    assert RoundingBound.find(network).decide(1.5 * pixels)[1].all()


def test_subnormal_numbers_may_count_as_zero():
    network = MLP((1, 1, 1), 2, hidden=(1,))
    with torch.no_grad():
        network.layers.get_parameter("fc1.weight").fill_(0.9 * 2.0**-126)
        network.layers.get_parameter("logits.weight").copy_(torch.tensor([[2.0**126], [0.0]]))
        network.layers.get_parameter("logits.bias").copy_(torch.tensor([0.0, 0.5]))
    assert RoundingBound.find(network).decide(torch.ones(1, 1, 1, 1))[1].all()


def test_a_forward_pass_of_its_own_has_no_known_bound():
    assert RoundingBound.find(Mirrored((1, 25, 64), 3)) is None


def test_bound_covers_inputs_of_other_evaluations():
    """The input is 0 in one evaluation, up to 1 exactly, and up to 2 in another evaluation."""
    layer = nn.Linear(1, 1)
    with torch.no_grad():
        layer.weight.fill_(1.5e38)
        layer.bias.zero_()
    none, one = torch.zeros(1, 1).double(), torch.ones(1, 1).double()
    assert rounded(layer).bound(none, one).isfinite().all()  # 2 * 1.5e38 does not overflow
    assert rounded(layer).bound(none, 1.2 * one).isinf().all()  # 2.4 * 1.5e38 does


def test_bound_of_a_sum_of_four_ones_by_hand():
    """Five terms with the bias: 5 roundings of partial sums up to 4, and 2 of each of 4 terms."""
    layer = nn.Linear(4, 1)
    with torch.no_grad():
        layer.weight.fill_(1.0)
        layer.bias.zero_()
    ones = torch.ones(1, 4).double()
    bound = rounded(layer).bound(ones, torch.zeros_like(ones))
    assert bound.item() == pytest.approx((5 * 4 + 2 * 4) * 2.0**-24, rel=0.01)


def test_partial_sums_are_at_most_the_positive_terms():
    """Terms 1, -1, 1, -1 add up to 0 and no partial sum exceeds 2: 5 roundings of 2, 2 of 4."""
    layer = nn.Linear(4, 1)
    with torch.no_grad():
        layer.weight.copy_(torch.tensor([[1.0, -1.0, 1.0, -1.0]]))
        layer.bias.zero_()
    ones = torch.ones(1, 4).double()
    made, error, _ = rounded(layer).run(ones, torch.zeros_like(ones))
    assert made.item() == 0.0
    assert error.item() == pytest.approx((5 * 2 + 2 * 4) * 2.0**-24, rel=0.01)
