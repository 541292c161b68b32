"""Forward and backward pass of a small network on a CPU.

Gradients of the logits are computed with respect to the weights or to the frames. Each core passes
a block of frames at a time through all layers, so that its numbers stay in cache.
"""

import warp as wp

from drone_rl.acceleration.layers_kernel import (
    PREAMBLE,
    LayerGeometry,
    Layers,
    copy,
    multiply,
    row_size,
    run_branches,
    run_trunk,
)

_TILES = (
    PREAMBLE
    + """
#ifdef __AVX512F__
typedef numbers many[8];
#else
typedef numbers many[4];
#endif
typedef numbers one[1];
constexpr int MANY = sizeof(many) / sizeof(one), NEAR = 64;
const int delta_stride = g.output_stride, gradients_offset = g.weights_offset;
const float* delta = deltas.data + g.output_offset;
auto tile = [&](auto* shape, int plane, int row, int i, int outs) __attribute__((always_inline)) {
    constexpr int INPUTS = sizeof(*shape) / sizeof(numbers);
    float* sums_at = gradients.data + gradients_offset + outs / 16 * panel;
    sums_at += (1 + (plane * kernel_rows + row) * length + i) * 16;
    numbers sums[INPUTS];
    #pragma unroll
    for (int k = 0; k < INPUTS; ++k) sums[k] = *(const anywhere*)(sums_at + k * 16);
    const float* first = input + row * kernel_row_stride + i;
    first += plane * (kernel_rows * kernel_row_stride + g.plane_skip);
    const float* by = delta + outs;
    for (int patch = 0; patch < num_patches; patch += columns) {
        const float* from = first;
        for (int column = 0; column < columns; ++column) {
            numbers now = *(const anywhere*)by;
            #pragma unroll
            for (int k = 0; k < INPUTS; ++k) sums[k] = add(sums[k], from[k], now);
            from += column_stride;
            by += delta_stride;
        }
        first += row_stride;
    }
    #pragma unroll
    for (int k = 0; k < INPUTS; ++k) *(anywhere*)(sums_at + k * 16) = sums[k];
};
for (int outs = 0; outs < num_outs; outs += 16) {
    anywhere* sum_at = (anywhere*)(gradients.data + gradients_offset + outs / 16 * panel);
    numbers sum = *sum_at;
    const float* by = delta + outs;
    for (int patch = 0; patch < num_patches; ++patch, by += delta_stride)
        sum += *(const anywhere*)by;
    *sum_at = sum;
}
for (int plane = 0; plane < planes; ++plane) {
    for (int row = 0; row < kernel_rows; ++row) {
        for (int from = 0; from < length; from += NEAR) {
            int to = from + NEAR < length ? from + NEAR : length;
            for (int outs = 0; outs < num_outs; outs += 16) {
                int i = from;
                for (; i + MANY <= to; i += MANY) tile((many*)nullptr, plane, row, i, outs);
                for (; i < to; ++i) tile((one*)nullptr, plane, row, i, outs);
            }
        }
    }
}
"""
)


@wp.func_native(_TILES)
def add_weight_gradients(
    inputs: wp.array[float], deltas: wp.array[float], gradients: wp.array[float], g: LayerGeometry
) -> None:
    """Add the gradient with respect to the weights; `deltas` is that with respect to outputs."""
    ...


@wp.func_native("""
#pragma clang fp contract(off)
float* to = target.data + g.input_offset;
for (int i = 0; i < size; ++i) to[i] = 0.0f;
const float* from = patches.data;
const int columns = g.patches_per_row;
for (int number = 0; number < g.num_patches; ++number) {
    float* patch = to + number / columns * g.row_stride + number % columns * g.column_stride;
    for (int plane = 0; plane < g.num_planes; ++plane, patch += g.plane_skip) {
        for (int row = 0; row < g.kernel_rows; ++row) {
            for (int i = 0; i < g.kernel_row_length; ++i) patch[i] += from[i];
            patch += g.kernel_row_stride;
            from += g.kernel_row_length;
        }
    }
}
""")
def fold(patches: wp.array[float], target: wp.array[float], size: int, g: LayerGeometry) -> None:
    """Overwrite `size` numbers at `g.input_offset` with the sum of overlapping patches."""
    ...


@wp.func_native("""
float* to = deltas.data + delta_at;
const float* by = outputs.data + output_at;
for (int i = 0; i < size; ++i) to[i] = by[i] > 0.0f ? to[i] : 0.0f;
""")
def rectify(
    deltas: wp.array[float], delta_at: int, outputs: wp.array[float], output_at: int, size: int
) -> None:
    """Set the gradient to 0 where the output of a ReLU is 0."""
    ...


@wp.func_native("""
const int columns = g.patches_per_row / g.pool_size, stride = g.num_outs;
const int rows = g.num_patches / g.patches_per_row / g.pool_size;
const float* kept = outputs.data + kept_at;
const float* delta = deltas.data + kept_delta_at;
float* to = deltas.data + g.output_offset;
for (int i = 0; i < g.num_patches * stride; ++i) to[i] = 0.0f;
for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column, kept += stride, delta += stride) {
        const int first = g.pool_size * (row * g.patches_per_row + column) * stride;
        for (int i = 0; i < stride; ++i) {
            bool is_open = kept[i] > 0.0f;
            for (int y = 0; y < g.pool_size; ++y) {
                for (int x = 0; x < g.pool_size; ++x) {
                    const int at = first + (y * g.patches_per_row + x) * stride + i;
                    const bool is_largest = is_open && outputs.data[output_at + at] == kept[i];
                    if (is_largest) to[at] = delta[i];
                    is_open = is_open && !is_largest;
                }
            }
        }
    }
}
""")
def unpool(
    outputs: wp.array[float],
    output_at: int,
    kept_at: int,
    deltas: wp.array[float],
    kept_delta_at: int,
    g: LayerGeometry,
) -> None:
    """Give the gradient of each maximum to the first output that has it, as PyTorch does.

    `output_at` and `kept_at` are the offsets of the outputs before and after pooling,
    `kept_delta_at` that of the latter's gradients; those of the former go to `g.output_offset`.
    """
    ...


BLOCK = wp.constant(64)
"""Frames at a time."""


@wp.struct
class PackedParams:
    """A network, and what the backward pass needs of it."""

    layers: Layers
    transposed: wp.array[LayerGeometry]
    """Of each layer, from gradients of outputs to those of patches, without offsets."""
    transposed_weights: wp.array[float]
    inputs_stride: int
    """Stride between the inputs of the trunk of two frames in `Workspace.inputs`."""


@wp.struct
class FrameBatch:
    """Frames with outputs and gradients."""

    frames: wp.array2d[float]
    """Observations: images, channels first, then vectors. Shape: (num_frames, numbers)."""
    outputs: wp.array[float]
    """Outputs of all layers, row after row, as `forward` writes them."""
    rows: wp.array[int]
    """Row in `outputs` of each frame."""
    grad_output: wp.array2d[float]
    """Gradient with respect to the logits. Shape: (num_frames, num_actions)."""
    grad_frames: wp.array2d[float]
    """Receives the gradient with respect to the frames; of shape (0, 0) if it is not needed."""


@wp.struct
class Workspace:
    """Buffers of one worker, for one block."""

    deltas: wp.array[float]
    """Gradients with respect to the outputs of all layers."""
    inputs: wp.array[float]
    """Inputs of the trunk's layers, side by side."""
    patches: wp.array[float]
    """Gradients with respect to the patches of one layer of a branch."""
    gradients: wp.array[float]
    """Accumulates the gradient with respect to the weights; empty if it is not needed."""


@wp.kernel
def forward(first: int, last: int, params: PackedParams, batch: FrameBatch) -> None:
    """Compute the outputs of all layers of frames `first` to `last` - 1; launch dimension 1."""
    for block in range(first, last, BLOCK):
        end = wp.min(block + BLOCK, last)
        for frame in range(block, end):
            run_branches(params.layers, batch.frames[frame], batch.outputs, frame)
        run_trunk(params.layers, batch.outputs, block, end - block)


@wp.func
def _delta_at(layers: Layers, layer: int, row: int) -> int:
    """Return where the gradients with respect to a layer's outputs after pooling are."""
    start = layers.starts[layer]
    at = BLOCK * start + layers.kept_offsets[layer] - start
    return at + row * layers.strides[layer]


@wp.func
def _num_kept(g: LayerGeometry) -> int:
    """Return the numbers of a frame that a layer keeps: its outputs after pooling."""
    if g.pool_size == 0:
        return g.num_patches * g.num_outs
    rows = g.num_patches / g.patches_per_row / g.pool_size
    return rows * (g.patches_per_row / g.pool_size) * g.num_outs


@wp.kernel
def backward(
    first: int, last: int, params: PackedParams, batch: FrameBatch, workspace: Workspace
) -> None:
    """Run the backward pass of frames `first` to `last` - 1; launch dimension 1."""
    layers = params.layers
    for block in range(first, last, BLOCK):
        end = wp.min(block + BLOCK, last)
        for frame in range(block, end):
            _begin(params, frame, block, batch, workspace)
        for i in range(layers.geometries.shape[0]):
            layer = layers.geometries.shape[0] - 1 - i
            if layer >= layers.num_branch_layers:
                _trunk_layer(params, layer, end - block, workspace)
            else:
                for frame in range(block, end):
                    _branch_layer(params, layer, frame, block, batch, workspace)


@wp.func
def _begin(
    params: PackedParams, frame: int, block: int, batch: FrameBatch, workspace: Workspace
) -> None:
    """Write the inputs of a frame's trunk layers, and the logits' gradient padded with zeros."""
    layers = params.layers
    inputs_offset = layers.kept_offsets[layers.sources[layers.num_branch_layers]]
    top = layers.geometries.shape[0] - 1
    row = frame - block
    source = batch.rows[frame] * row_size(layers) + inputs_offset
    size = layers.output_offsets[top] - inputs_offset
    copy(batch.outputs, source, workspace.inputs, row * params.inputs_stride, size)
    at = _delta_at(layers, top, row)
    for action in range(layers.geometries[top].num_outs):
        gradient = float(0.0)
        if action < batch.grad_output.shape[1]:
            gradient = batch.grad_output[frame, action]
        workspace.deltas[at + action] = gradient


@wp.func
def _trunk_layer(params: PackedParams, layer: int, count: int, workspace: Workspace) -> None:
    """Compute the gradients with respect to the weights and inputs of a layer of the trunk."""
    layers = params.layers
    source = layers.sources[layer]
    first = layers.kept_offsets[layers.sources[layers.num_branch_layers]]
    inputs_offset = layers.kept_offsets[source] - first
    if workspace.gradients.shape[0] > 0:
        g = layers.geometries[layer]  # the frames' inputs, side by side, are its patches
        g.input_offset = inputs_offset
        g.output_offset = _delta_at(layers, layer, 0)
        g.num_patches = count
        g.patches_per_row = count
        g.row_stride = 0
        g.column_stride = params.inputs_stride
        g.output_stride = layers.strides[layer]
        add_weight_gradients(workspace.inputs, workspace.deltas, workspace.gradients, g)
    transposed = params.transposed[layer]
    transposed.input_offset = _delta_at(layers, layer, 0)
    transposed.output_offset = _delta_at(layers, source, 0)
    transposed.num_patches = count
    transposed.row_stride = layers.strides[layer]
    transposed.output_stride = layers.strides[source]
    multiply(workspace.deltas, params.transposed_weights, workspace.deltas, transposed)
    for row in range(count):
        delta = transposed.output_offset + row * transposed.output_stride
        output = inputs_offset + row * params.inputs_stride  # of the layer below
        rectify(workspace.deltas, delta, workspace.inputs, output, transposed.num_outs)


@wp.func
def _branch_layer(
    params: PackedParams,
    layer: int,
    frame: int,
    block: int,
    batch: FrameBatch,
    workspace: Workspace,
) -> None:
    """Do the same for a layer of a branch and one frame."""
    layers = params.layers
    row = frame - block
    frame_at = batch.rows[frame] * row_size(layers)
    source = layers.sources[layer]
    g = layers.geometries[layer]
    if source >= 0:
        g.input_offset = frame_at + layers.kept_offsets[source]
    kept_delta_at = _delta_at(layers, layer, row)
    g.output_offset = kept_delta_at
    if g.pool_size > 0:
        g.output_offset = BLOCK * layers.output_offsets[layer] + row * g.num_patches * g.num_outs
        outputs_at = frame_at + layers.output_offsets[layer]
        kept_at = frame_at + layers.kept_offsets[layer]
        unpool(batch.outputs, outputs_at, kept_at, workspace.deltas, kept_delta_at, g)
    if workspace.gradients.shape[0] > 0:
        if source < 0:
            add_weight_gradients(batch.frames[frame], workspace.deltas, workspace.gradients, g)
        else:
            add_weight_gradients(batch.outputs, workspace.deltas, workspace.gradients, g)
    if source < 0 and batch.grad_frames.shape[0] == 0:
        return
    transposed = params.transposed[layer]
    transposed.input_offset = g.output_offset
    multiply(workspace.deltas, params.transposed_weights, workspace.patches, transposed)
    if source < 0:
        fold(workspace.patches, batch.grad_frames[frame], batch.grad_frames.shape[1], g)
        return
    g.input_offset = _delta_at(layers, source, row)
    num_inputs = _num_kept(layers.geometries[source])
    fold(workspace.patches, workspace.deltas, num_inputs, g)
    inputs_at = frame_at + layers.kept_offsets[source]
    rectify(workspace.deltas, g.input_offset, batch.outputs, inputs_at, num_inputs)
