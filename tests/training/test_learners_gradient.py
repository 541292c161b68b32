"""Accumulated gradients equal those of the whole batch; NaN gradients are rejected."""

import pytest
import torch
from tensordict import TensorDict
from torch import nn

from drone_rl.training.learners import NotANumberError, accumulate, descend

X = torch.tensor([[1.0], [2.0], [6.0]])


def squares(layer, reduce=torch.mean):
    """Return the loss (w x)^2 and a metric."""

    def losses(chunk):
        value = reduce(layer(chunk["x"]).square())
        return TensorDict({"loss_square": value, "mean": chunk["x"].mean()}, [])

    return losses


def one_weight(value=1.0):
    layer = nn.Linear(1, 1, bias=False)
    nn.init.constant_(layer.weight, value)
    return layer


@pytest.mark.parametrize("chunk", [1, 2, 3, 100])
@pytest.mark.parametrize(("is_sum", "wanted"), [(False, 41 / 3), (True, 41.0)])
def test_gradient_and_terms_match_hand_computed_values(chunk, is_sum, wanted):
    """1 + 4 + 36 = 41; the gradient of w^2 s at w = 1 is 2 s."""
    layer = one_weight()
    losses = squares(layer, torch.sum if is_sum else torch.mean)
    terms = accumulate(TensorDict({"x": X}, [3]), losses, chunk, (lambda _: 1) if is_sum else len)
    assert terms == {"loss_square": pytest.approx(wanted), "mean": pytest.approx(3.0)}
    assert float(layer.weight.grad) == pytest.approx(2 * wanted)


@pytest.mark.parametrize(("most", "step"), [(None, 6.0), (10.0, 6.0), (1.5, 1.5)])
def test_gradient_norm_is_clipped(most, step):
    layer = one_weight()
    layer.weight.grad = torch.tensor([[6.0]])
    optimizer = torch.optim.SGD(layer.parameters(), lr=1.0)
    assert descend(optimizer, layer.named_parameters(), most) == pytest.approx(6.0)
    assert float(layer.weight.detach()) == pytest.approx(1.0 - step)


def test_nan_gradient_raises_without_a_step():
    layer = one_weight(float("nan"))
    with pytest.raises(NotANumberError, match=r"^loss_square is NaN"):
        accumulate(TensorDict({"x": X}, [3]), squares(layer), 2)
    layer = one_weight()
    layer.weight.grad = torch.tensor([[float("inf")]])
    with pytest.raises(NotANumberError, match=r"^the gradient of weight is NaN or infinite"):
        descend(torch.optim.SGD(layer.parameters(), lr=1.0), layer.named_parameters(), None)
    assert float(layer.weight.detach()) == 1.0
