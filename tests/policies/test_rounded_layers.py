import pytest
import torch
from torch import nn

from drone_rl.policies.rounded_layers import layer_of
from tests.own_networks import Doubled


def test_bound_covers_inputs_of_other_evaluations():
    """The input is 0 in one evaluation, up to 1 exactly, and up to 2 in another evaluation."""
    layer = nn.Linear(1, 1)
    with torch.no_grad():
        layer.weight.fill_(1.5e38)
        layer.bias.zero_()
    none, one = torch.zeros(1, 1).double(), torch.ones(1, 1).double()
    assert layer_of(layer).bound(none, one).isfinite().all()  # 2 * 1.5e38 does not overflow
    assert layer_of(layer).bound(none, 1.2 * one).isinf().all()  # 2.4 * 1.5e38 does


def test_bound_of_a_sum_of_four_ones_by_hand():
    """Five terms with the bias: 5 roundings of partial sums up to 4, and 2 of each of 4 terms."""
    layer = nn.Linear(4, 1)
    with torch.no_grad():
        layer.weight.fill_(1.0)
        layer.bias.zero_()
    ones = torch.ones(1, 4).double()
    bound = layer_of(layer).bound(ones, torch.zeros_like(ones))
    assert bound.item() == pytest.approx((5 * 4 + 2 * 4) * 2.0**-24, rel=0.01)


def test_partial_sums_are_at_most_the_positive_terms():
    """Terms 1, -1, 1, -1 add up to 0 and no partial sum exceeds 2: 5 roundings of 2, 2 of 4."""
    layer = nn.Linear(4, 1)
    with torch.no_grad():
        layer.weight.copy_(torch.tensor([[1.0, -1.0, 1.0, -1.0]]))
        layer.bias.zero_()
    ones = torch.ones(1, 4).double()
    made, error, _ = layer_of(layer).run(ones, torch.zeros_like(ones))
    assert made.item() == 0.0
    assert error.item() == pytest.approx((5 * 2 + 2 * 4) * 2.0**-24, rel=0.01)


def test_convolutions_with_padding_are_not_supported():
    assert layer_of(nn.Conv2d(1, 1, 2)) is not None
    for padding in (1, "valid"):
        assert layer_of(nn.Conv2d(1, 1, 2, padding=padding)) is None


@pytest.mark.parametrize(
    "layer", [Doubled(1, 2, 3), nn.utils.parametrizations.spectral_norm(nn.Conv2d(1, 2, 3))]
)
def test_layers_that_compute_something_else_are_not_supported(layer):
    assert layer_of(layer) is None
