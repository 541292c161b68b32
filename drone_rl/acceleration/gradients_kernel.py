"""Forward and backward pass of a small network on a CPU: gradients of its weights, or of frames.

Each core passes a block of frames at a time through all layers, so that its numbers stay in cache.
"""

import warp as wp

from drone_rl.acceleration.layers_backward_kernel import accumulate, fold, rectify
from drone_rl.acceleration.layers_kernel import Product, copy, multiply

BLOCK = wp.constant(64)
"""Frames at a time."""


@wp.struct
class PackedParams:
    """A network that learns."""

    products: wp.array[Product]
    """Forward pass of each layer; `forward` and `backward` set the offsets of inputs and outputs,
    and the rows of linear layers."""
    transposed: wp.array[Product]
    """The same from the gradient of each layer's outputs to that of its inputs."""
    weights: wp.array[float]
    back: wp.array[float]
    """Transposed weights."""
    made_at: wp.array[int]
    """Offset of each layer in the outputs of a frame, and the size of these."""
    num_convolutions: int
    inputs_stride: int
    """Stride between the linear layers' inputs of two frames in `Workspace.inputs`."""


@wp.struct
class Batch:
    """Frames with outputs and gradients."""

    frames: wp.array2d[float]
    """Gray. Shape: (num_frames, pixels)."""
    made: wp.array[float]
    """Outputs of all layers, row after row, as `forward` writes them."""
    rows: wp.array[int]
    """Row in `made` of each frame."""
    grad_output: wp.array2d[float]
    """Gradient of the logits. Shape: (num_frames, num_actions)."""
    grad_frames: wp.array2d[float]
    """Gradient of the frames, written; of shape (0, 0) if it is not needed."""


@wp.struct
class Workspace:
    """Buffers of one worker, for one block."""

    deltas: wp.array[float]
    """Gradients of the outputs of all layers."""
    inputs: wp.array[float]
    """Inputs of the linear layers, side by side."""
    patches: wp.array[float]
    """Gradients of the patches of one convolution."""
    gradients: wp.array[float]
    """Gradient of the weights, added to; empty if it is not needed."""


@wp.kernel
def forward(first: int, last: int, params: PackedParams, batch: Batch) -> None:
    """Compute the outputs of all layers of frames `first` to `last` - 1.

    Launch it with a dimension of 1.
    """
    size = _size(params)
    for block in range(first, last, BLOCK):
        for frame in range(block, wp.min(block + BLOCK, last)):
            for layer in range(params.num_convolutions):
                p = params.products[layer]
                p.made_at = frame * size + params.made_at[layer]
                if layer == 0:
                    multiply(batch.frames[frame], params.weights, batch.made, p)
                else:
                    p.given_at = frame * size + params.made_at[layer - 1]
                    multiply(batch.made, params.weights, batch.made, p)
        for layer in range(params.num_convolutions, params.products.shape[0]):
            p = params.products[layer]
            p.given_at = block * size + params.made_at[layer - 1]
            p.made_at = block * size + params.made_at[layer]
            p.rows = wp.min(BLOCK, last - block)
            p.down = size
            p.made_down = size
            multiply(batch.made, params.weights, batch.made, p)


@wp.func
def _size(params: PackedParams) -> int:
    """Numbers of the outputs of a frame."""
    return params.made_at[params.products.shape[0]]


@wp.func
def _stride(params: PackedParams, layer: int) -> int:
    """Numbers of the outputs of a layer, with padding."""
    return params.made_at[layer + 1] - params.made_at[layer]


@wp.kernel
def backward(
    first: int, last: int, params: PackedParams, batch: Batch, workspace: Workspace
) -> None:
    """Compute gradients of frames `first` to `last` - 1, or of the weights from these.

    Launch it with a dimension of 1.
    """
    for block in range(first, last, BLOCK):
        end = wp.min(block + BLOCK, last)
        for frame in range(block, end):
            _begin(params, frame, block, batch, workspace)
        for down in range(params.products.shape[0]):
            layer = params.products.shape[0] - 1 - down
            if layer >= params.num_convolutions:
                _linear(params, layer, end - block, workspace)
            else:
                for frame in range(block, end):
                    _convolution(params, layer, frame, block, batch, workspace)


@wp.func
def _begin(
    params: PackedParams, frame: int, block: int, batch: Batch, workspace: Workspace
) -> None:
    """Write the gradient of a frame's logits, padded with zeros, and its linear layers' inputs."""
    inputs_at = params.made_at[params.num_convolutions - 1]
    top = params.products.shape[0] - 1
    row = frame - block
    given_at = batch.rows[frame] * _size(params) + inputs_at
    size = params.made_at[top] - inputs_at
    copy(batch.made, given_at, workspace.inputs, row * params.inputs_stride, size)
    at = BLOCK * params.made_at[top] + row * _stride(params, top)
    for action in range(params.products[top].num_outs):
        slope = float(0.0)
        if action < batch.grad_output.shape[1]:
            slope = batch.grad_output[frame, action]
        workspace.deltas[at + action] = slope


@wp.func
def _linear(params: PackedParams, layer: int, count: int, workspace: Workspace) -> None:
    """Compute the gradients of a linear layer's weights and inputs from that of its outputs."""
    inputs_at = params.made_at[layer - 1] - params.made_at[params.num_convolutions - 1]
    if workspace.gradients.shape[0] > 0:
        p = params.products[layer]  # the frames' inputs, side by side, are its patches
        p.given_at = inputs_at
        p.made_at = BLOCK * params.made_at[layer]
        p.rows = count
        p.columns = count
        p.down = 0
        p.across = params.inputs_stride
        p.made_down = _stride(params, layer)
        accumulate(workspace.inputs, workspace.deltas, workspace.gradients, p)
    back = params.transposed[layer]
    back.given_at = BLOCK * params.made_at[layer]
    back.made_at = BLOCK * params.made_at[layer - 1]
    back.rows = count
    back.down = _stride(params, layer)
    back.made_down = _stride(params, layer - 1)
    multiply(workspace.deltas, params.back, workspace.deltas, back)
    for row in range(count):
        deltas_at = back.made_at + row * back.made_down
        given_at = inputs_at + row * params.inputs_stride
        rectify(workspace.deltas, deltas_at, workspace.inputs, given_at, back.num_outs)


@wp.func
def _convolution(
    params: PackedParams, layer: int, frame: int, block: int, batch: Batch, workspace: Workspace
) -> None:
    """Compute the gradients of a convolution's weights and input, for one frame."""
    deltas_at = BLOCK * params.made_at[layer] + (frame - block) * _stride(params, layer)
    given_at = int(0)
    if layer > 0:
        given_at = batch.rows[frame] * _size(params) + params.made_at[layer - 1]
    p = params.products[layer]
    p.given_at = given_at
    p.made_at = deltas_at
    if workspace.gradients.shape[0] > 0:
        if layer == 0:
            accumulate(batch.frames[frame], workspace.deltas, workspace.gradients, p)
        else:
            accumulate(batch.made, workspace.deltas, workspace.gradients, p)
    if layer == 0 and batch.grad_frames.shape[0] == 0:
        return
    back = params.transposed[layer]
    back.given_at = deltas_at
    multiply(workspace.deltas, params.back, workspace.patches, back)
    if layer == 0:
        fold(workspace.patches, batch.grad_frames[frame], batch.grad_frames.shape[1], p)
        return
    before = layer - 1
    p.given_at = BLOCK * params.made_at[before] + (frame - block) * _stride(params, before)
    size = params.products[before].rows * params.products[before].num_outs
    fold(workspace.patches, workspace.deltas, size, p)
    rectify(workspace.deltas, p.given_at, batch.made, given_at, size)
