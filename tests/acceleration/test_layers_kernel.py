"""Layers on one core equal torch for all sizes."""

import pytest
import torch
import warp as wp
from torch.nn import functional

from drone_rl.acceleration.layers_kernel import Product, multiply
from drone_rl.acceleration.packed_layers import as_products, in_panels
from drone_rl.sim.rendering.devices import start_warp

start_warp("cpu")
OFFSET = 3
"""Offset of all values in their arrays, to detect functions that ignore it."""


@wp.kernel(enable_backward=False)
def run(
    given: wp.array(dtype=float),
    weights: wp.array(dtype=float),
    made: wp.array(dtype=float),
    products: wp.array(dtype=Product),
) -> None:
    multiply(given, weights, made, products[0])


def multiplied(given, weights, num_made, *sizes, made_down=None):
    """Return the outputs of `multiply`; weights are sorted by input."""
    *sizes, is_rectified = sizes
    product = as_products([[OFFSET, OFFSET, OFFSET, *sizes, made_down or sizes[-1], is_rectified]])
    weights = in_panels(weights)
    made = torch.full((OFFSET + num_made + 1,), torch.inf)
    arrays = [wp.from_torch(functional.pad(v.flatten(), (OFFSET, 0))) for v in (given, weights)]
    wp.launch(run, 1, inputs=[*arrays, wp.from_torch(made), product], device="cpu")
    assert made[:OFFSET].isinf().all() and made[-1].isinf()  # the padding is unchanged
    return made[OFFSET:-1]


def test_outputs_match_hand_computed_values():
    # two rows of two numbers; outputs: sum, difference and 14 zeros
    weights = torch.zeros(3, 16)
    weights[0, :2] = torch.tensor([10.0, -10.0])
    weights[1:, :2] = torch.tensor([[1.0, 1.0], [1.0, -1.0]])
    given = torch.tensor([[1.0, 2.0], [3.0, 20.0]])
    for is_rectified, second in ((0, [-11.0, -27.0]), (1, [0.0, 0.0])):
        made = multiplied(given, weights, 32, 2, 1, 2, 0, 1, 2, 0, 16, is_rectified).view(2, 16)
        assert made[:, 0].tolist() == [13.0, 33.0] and made[:, 1].tolist() == second
        assert not made[:, 2:].any()


@pytest.mark.parametrize("rows", [1, 3, 4, 7, 8, 9, 17])
@pytest.mark.parametrize("num_outs", [16, 32, 48, 80])
def test_linear_layers_equal_torch(rows, num_outs):
    given, weight, bias = torch.randn(rows, 37), torch.randn(37, num_outs), torch.randn(num_outs)
    weights = torch.cat([bias[None], weight])
    made = multiplied(given, weights, rows * num_outs, rows, 1, 37, 0, 1, 37, 0, num_outs, 0)
    assert torch.allclose(made.view(rows, -1), given @ weight + bias, atol=1e-4)


def test_outputs_can_have_a_row_stride():
    given, weights = torch.randn(9, 37), torch.randn(38, 32)
    sizes = (9, 1, 37, 0, 1, 37, 0, 32, 0)
    made = multiplied(given, weights, 9 * 48, *sizes, made_down=48).view(9, 48)
    assert torch.equal(made[:, :32].flatten(), multiplied(given, weights, 9 * 32, *sizes))
    assert made[:, 32:].isinf().all()


def test_rows_are_independent():
    given, weights = torch.randn(9, 37), torch.randn(38, 48)
    whole = multiplied(given, weights, 9 * 48, 9, 1, 37, 0, 1, 37, 0, 48, 0).view(9, 48)
    for i, row in enumerate(given):
        alone = multiplied(row, weights, 48, 1, 1, 37, 0, 1, 37, 0, 48, 0)
        assert torch.equal(alone, whole[i])


@pytest.mark.parametrize(("kernel", "stride"), [((3, 3), 1), ((4, 4), 4), ((2, 5), 3)])
def test_convolutions_equal_torch(kernel, stride):
    channels, height, width, outs = 16, 11, 13, 32
    image, weight = torch.randn(1, channels, height, width), torch.randn(outs, channels, *kernel)
    bias = torch.randn(outs)
    expected = functional.conv2d(image, weight, bias, stride).relu()[0].permute(1, 2, 0)
    rows, columns, _ = expected.shape
    weights = torch.cat([bias[None], weight.permute(2, 3, 1, 0).reshape(-1, outs)])
    line = width * channels
    patch = (kernel[0], kernel[1] * channels, line)
    steps = (rows * columns, columns, stride * line, stride * channels)
    given = image[0].permute(1, 2, 0)
    made = multiplied(given, weights, expected.numel(), *steps, *patch, outs, 1)
    assert torch.allclose(made.view(expected.shape), expected, atol=1e-4)
