import torch
from torch import nn

from drone_rl.policies.rounded_layers import layer_of


def test_a_bound_holds_for_inputs_that_another_evaluation_has():
    """One evaluation's input is 0, the exact one up to 1, and another one's up to 2."""
    layer = nn.Linear(1, 1)
    with torch.no_grad():
        layer.weight.fill_(1.5e38)
        layer.bias.zero_()
    none, one = torch.zeros(1, 1).double(), torch.ones(1, 1).double()
    assert layer_of(layer).bound(none, one).isfinite().all()  # 2 * 1.5e38 does not overflow
    assert layer_of(layer).bound(none, 1.2 * one).isinf().all()  # 2.4 * 1.5e38 does
