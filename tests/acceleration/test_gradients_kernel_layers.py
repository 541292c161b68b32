"""The functions of the backward pass equal torch for all sizes."""

import pytest
import torch
import warp as wp
from torch.nn import functional

from drone_rl.acceleration.gradients_kernel import accumulate, fold, rectify
from drone_rl.acceleration.layers_kernel import LayerGeometry
from drone_rl.acceleration.packed_layers import as_geometries, in_panels
from drone_rl.sim.rendering.devices import start_warp

start_warp("cpu")
OFFSET = 3
"""Offset of all values in their arrays, to detect functions that ignore it."""


@wp.kernel(enable_backward=False)
def accumulate_once(
    inputs: wp.array(dtype=float),
    deltas: wp.array(dtype=float),
    gradients: wp.array(dtype=float),
    geometries: wp.array(dtype=LayerGeometry),
) -> None:
    accumulate(inputs, deltas, gradients, geometries[0])


@wp.kernel(enable_backward=False)
def fold_once(
    patches: wp.array(dtype=float),
    target: wp.array(dtype=float),
    size: int,
    geometries: wp.array(dtype=LayerGeometry),
) -> None:
    fold(patches, target, size, geometries[0])


@wp.kernel(enable_backward=False)
def rectify_once(deltas: wp.array(dtype=float), outputs: wp.array(dtype=float), size: int) -> None:
    rectify(deltas, OFFSET, outputs, OFFSET - 1, size)


def padded(values, fill=torch.inf):
    """Return the values with padding in front and one value behind."""
    return functional.pad(values.flatten(), (OFFSET, 1), value=fill)


def unpadded(values):
    assert values[:OFFSET].isinf().all() and values[-1].isinf()  # the padding is unchanged
    return values[OFFSET:-1]


def accumulated(given, deltas, before, geometry):
    gradients = padded(in_panels(before))
    arrays = [wp.from_torch(v) for v in (padded(given), padded(deltas), gradients)]
    offsets = dict.fromkeys(("input_offset", "weights_offset", "output_offset"), OFFSET)
    geometries = as_geometries([{**offsets, **geometry}])
    wp.launch(accumulate_once, 1, inputs=[*arrays, geometries], device="cpu")
    panels = unpadded(gradients).view(-1, len(before), 16)
    return panels.transpose(0, 1).reshape(before.shape)


def linear(count, length, num_outs, output_stride):
    """Return the geometry of `count` vectors of `length` numbers, side by side."""
    return {
        "num_patches": count,
        "patches_per_row": count,
        "column_stride": length,
        "kernel_rows": 1,
        "kernel_row_length": length,
        "num_outs": num_outs,
        "output_stride": output_stride,
    }


def test_weight_gradients_match_hand_computed_values():
    given = torch.tensor([[1.0, 2.0], [3.0, 5.0]])
    deltas = torch.zeros(2, 16)
    deltas[:, 0] = torch.tensor([10.0, 100.0])
    before = torch.ones(3, 16)
    # contiguous rows of two numbers
    found = accumulated(given, deltas, before, linear(2, 2, 16, 16))
    assert found[:, 0].tolist() == [111.0, 311.0, 521.0]  # bias, first and second input
    assert torch.equal(found[:, 1:], torch.ones(3, 15))


@pytest.mark.parametrize("rows", [1, 5, 17])
@pytest.mark.parametrize("num_outs", [16, 48])
@pytest.mark.parametrize("length", [3, 8, 70, 131])
def test_gradients_of_linear_layers_equal_torch(rows, num_outs, length):
    given, deltas = torch.randn(rows, length), torch.randn(rows, num_outs)
    before = torch.randn(1 + length, num_outs)
    apart = functional.pad(deltas, (0, 7))
    found = accumulated(given, apart, before, linear(rows, length, num_outs, num_outs + 7))
    expected = before + torch.cat([deltas.sum(0, keepdim=True), given.T @ deltas])
    assert torch.allclose(found, expected, atol=1e-4)


@pytest.mark.parametrize(("kernel", "stride"), [((3, 3), 1), ((4, 4), 4), ((2, 5), 3)])
def test_gradients_of_convolutions_equal_torch(kernel, stride):
    channels, height, width, outs = 16, 11, 13, 32
    image = torch.randn(1, channels, height, width, requires_grad=True)
    weight = torch.randn(outs, channels, *kernel, requires_grad=True)
    bias = torch.randn(outs, requires_grad=True)
    outputs = functional.conv2d(image, weight, bias, stride)
    deltas = torch.randn_like(outputs)
    outputs.backward(deltas)
    rows, columns = outputs.shape[2:]
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
    }
    by_patch = deltas[0].permute(1, 2, 0).reshape(-1, outs)
    before = torch.zeros(1 + channels * kernel[0] * kernel[1], outs)
    given = image.detach()[0].permute(1, 2, 0)
    found = accumulated(given, by_patch, before, geometry)
    expected = torch.cat([bias.grad[None], weight.grad.permute(2, 3, 1, 0).reshape(-1, outs)])
    assert torch.allclose(found, expected, atol=1e-3)

    patches = by_patch @ weight.detach().permute(2, 3, 1, 0).reshape(-1, outs).T
    folded = torch.full((OFFSET + given.numel() + 1,), torch.inf)
    geometries = as_geometries([{**geometry, "input_offset": OFFSET, "num_outs": 0}])
    arrays = [wp.from_torch(patches.flatten()), wp.from_torch(folded)]
    inputs = [*arrays, given.numel(), geometries]
    wp.launch(fold_once, 1, inputs=inputs, device="cpu")
    expected = image.grad[0].permute(1, 2, 0).flatten()
    assert torch.allclose(unpadded(folded), expected, atol=1e-3)


def test_relu_blocks_gradients_of_zero_outputs():
    deltas = padded(torch.tensor([1.0, 2.0, 3.0, 4.0]))
    outputs = torch.tensor([0.0, 0.0, 0.5, 0.0, -1.0, 2.0])  # used from the third value on
    inputs = [wp.from_torch(deltas), wp.from_torch(outputs), 4]
    wp.launch(rectify_once, 1, inputs=inputs, device="cpu")
    assert unpadded(deltas).tolist() == [1.0, 0.0, 0.0, 4.0]
