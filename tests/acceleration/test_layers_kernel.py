"""Layers on one core equal torch for all sizes."""

import pytest
import torch
import warp as wp
from torch.nn import functional

from drone_rl.acceleration.layers_kernel import LayerGeometry, multiply
from drone_rl.acceleration.packed_layers import as_geometries, in_panels
from drone_rl.sim.rendering.devices import start_warp

start_warp("cpu")
OFFSET = 3
"""Offset of all values in their arrays, to detect functions that ignore it."""


@wp.kernel(enable_backward=False)
def run(
    inputs: wp.array(dtype=float),
    weights: wp.array(dtype=float),
    outputs: wp.array(dtype=float),
    geometries: wp.array(dtype=LayerGeometry),
) -> None:
    multiply(inputs, weights, outputs, geometries[0])


def multiplied(given, weights, size, geometry):
    """Return the `size` outputs of `multiply`; weights are sorted by input."""
    offsets = dict.fromkeys(("input_offset", "weights_offset", "output_offset"), OFFSET)
    geometries = as_geometries([{**offsets, **geometry}])
    weights = in_panels(weights)
    outputs = torch.full((OFFSET + size + 1,), torch.inf)
    arrays = [wp.from_torch(functional.pad(v.flatten(), (OFFSET, 0))) for v in (given, weights)]
    wp.launch(run, 1, inputs=[*arrays, wp.from_torch(outputs), geometries], device="cpu")
    assert outputs[:OFFSET].isinf().all() and outputs[-1].isinf()  # the padding is unchanged
    return outputs[OFFSET:-1]


def linear(count, length, num_outs, **changes):
    """Return the geometry of a linear layer for `count` vectors of `length` numbers."""
    return {
        "num_patches": count,
        "patches_per_row": 1,
        "row_stride": length,
        "kernel_rows": 1,
        "kernel_row_length": length,
        "num_outs": num_outs,
        "output_stride": num_outs,
        **changes,
    }


def test_outputs_match_hand_computed_values():
    # two rows of two numbers; outputs: sum, difference and 14 zeros
    weights = torch.zeros(3, 16)
    weights[0, :2] = torch.tensor([10.0, -10.0])
    weights[1:, :2] = torch.tensor([[1.0, 1.0], [1.0, -1.0]])
    given = torch.tensor([[1.0, 2.0], [3.0, 20.0]])
    for is_rectified, second in ((0, [-11.0, -27.0]), (1, [0.0, 0.0])):
        geometry = linear(2, 2, 16, is_rectified=is_rectified)
        outputs = multiplied(given, weights, 32, geometry).view(2, 16)
        assert outputs[:, 0].tolist() == [13.0, 33.0] and outputs[:, 1].tolist() == second
        assert not outputs[:, 2:].any()


@pytest.mark.parametrize("rows", [1, 3, 4, 7, 8, 9, 17])
@pytest.mark.parametrize("num_outs", [16, 32, 48, 80])
def test_linear_layers_equal_torch(rows, num_outs):
    given, weight, bias = torch.randn(rows, 37), torch.randn(37, num_outs), torch.randn(num_outs)
    weights = torch.cat([bias[None], weight])
    outputs = multiplied(given, weights, rows * num_outs, linear(rows, 37, num_outs))
    assert torch.allclose(outputs.view(rows, -1), given @ weight + bias, atol=1e-4)


def test_outputs_can_have_a_row_stride():
    given, weights = torch.randn(9, 37), torch.randn(38, 32)
    apart = multiplied(given, weights, 9 * 48, linear(9, 37, 32, output_stride=48)).view(9, 48)
    outputs = multiplied(given, weights, 9 * 32, linear(9, 37, 32))
    assert torch.equal(apart[:, :32].flatten(), outputs)
    assert apart[:, 32:].isinf().all()


def test_rows_are_independent():
    given, weights = torch.randn(9, 37), torch.randn(38, 48)
    whole = multiplied(given, weights, 9 * 48, linear(9, 37, 48)).view(9, 48)
    for i, row in enumerate(given):
        alone = multiplied(row, weights, 48, linear(1, 37, 48))
        assert torch.equal(alone, whole[i])


@pytest.mark.parametrize(("kernel", "stride"), [((3, 3), 1), ((4, 4), 4), ((2, 5), 3)])
def test_convolutions_equal_torch(kernel, stride):
    channels, height, width, outs = 16, 11, 13, 32
    image, weight = torch.randn(1, channels, height, width), torch.randn(outs, channels, *kernel)
    bias = torch.randn(outs)
    expected = functional.conv2d(image, weight, bias, stride).relu()[0].permute(1, 2, 0)
    rows, columns, _ = expected.shape
    weights = torch.cat([bias[None], weight.permute(2, 3, 1, 0).reshape(-1, outs)])
    geometry = {
        "num_patches": rows * columns,
        "patches_per_row": columns,
        "row_stride": stride * width * channels,
        "column_stride": stride * channels,
        "kernel_rows": kernel[0],
        "kernel_row_length": kernel[1] * channels,
        "kernel_row_stride": width * channels,
        "num_outs": outs,
        "output_stride": outs,
        "is_rectified": 1,
    }
    given = image[0].permute(1, 2, 0)
    outputs = multiplied(given, weights, expected.numel(), geometry)
    assert torch.allclose(outputs.view(expected.shape), expected, atol=1e-4)
