"""Forward and backward pass of a small network on a CPU: gradients of its weights, or of frames.

Each core passes a block of frames at a time through all layers, so that its numbers stay in cache.
"""

import warp as wp

from drone_rl.acceleration.layers_kernel import NUMBERS, Product, copy, multiply

_TILES = (
    NUMBERS
    + """
#ifdef __AVX512F__
typedef numbers many[8];
#else
typedef numbers many[4];
#endif
typedef numbers one[1];
constexpr int MANY = sizeof(many) / sizeof(one), NEAR = 64;
const int rows = g.rows, columns = g.columns, down = g.down, across = g.across;
const int lines = g.lines, length = g.length, next_line = g.next_line, num_outs = g.num_outs;
const int deltas_down = g.made_down, gradients_at = g.weights_at;
const float* input = given.data + g.given_at;
const float* delta = deltas.data + g.made_at;
const int panel = 16 * (1 + lines * length);
auto tile = [&](auto* shape, int line, int i, int outs) __attribute__((always_inline)) {
    constexpr int INPUTS = sizeof(*shape) / sizeof(numbers);
    float* sums_at = gradients.data + gradients_at + outs / 16 * panel;
    sums_at += (1 + line * length + i) * 16;
    numbers sums[INPUTS];
    #pragma unroll
    for (int k = 0; k < INPUTS; ++k) sums[k] = *(const anywhere*)(sums_at + k * 16);
    const float* first = input + line * next_line + i;
    const float* by = delta + outs;
    for (int row = 0; row < rows; row += columns) {
        const float* from = first;
        for (int column = 0; column < columns; ++column) {
            numbers now = *(const anywhere*)by;
            #pragma unroll
            for (int k = 0; k < INPUTS; ++k) sums[k] = add(sums[k], from[k], now);
            from += across;
            by += deltas_down;
        }
        first += down;
    }
    #pragma unroll
    for (int k = 0; k < INPUTS; ++k) *(anywhere*)(sums_at + k * 16) = sums[k];
};
for (int outs = 0; outs < num_outs; outs += 16) {
    anywhere* sum_at = (anywhere*)(gradients.data + gradients_at + outs / 16 * panel);
    numbers sum = *sum_at;
    const float* by = delta + outs;
    for (int row = 0; row < rows; ++row, by += deltas_down) sum += *(const anywhere*)by;
    *sum_at = sum;
}
for (int line = 0; line < lines; ++line) {
    for (int from = 0; from < length; from += NEAR) {
        int to = from + NEAR < length ? from + NEAR : length;
        for (int outs = 0; outs < num_outs; outs += 16) {
            int i = from;
            for (; i + MANY <= to; i += MANY) tile((many*)nullptr, line, i, outs);
            for (; i < to; ++i) tile((one*)nullptr, line, i, outs);
        }
    }
}
"""
)


@wp.func_native(_TILES)
def accumulate(
    given: wp.array[float], deltas: wp.array[float], gradients: wp.array[float], g: Product
) -> None:
    """Add to the gradient of the weights, from inputs `given`, gradients `deltas` of outputs."""
    ...


@wp.func_native("""
#pragma clang fp contract(off)
float* to = made.data + g.given_at;
for (int i = 0; i < size; ++i) to[i] = 0.0f;
const float* from = patches.data;
for (int row = 0; row < g.rows; ++row) {
    float* patch = to + row / g.columns * g.down + row % g.columns * g.across;
    for (int line = 0; line < g.lines; ++line) {
        for (int i = 0; i < g.length; ++i) patch[i] += from[i];
        patch += g.next_line;
        from += g.length;
    }
}
""")
def fold(patches: wp.array[float], made: wp.array[float], size: int, g: Product) -> None:
    """Add patches of the input of a layer with geometry `g` to `size` numbers at `g.given_at`."""
    ...


@wp.func_native("""
float* to = deltas.data + deltas_at;
const float* by = made.data + made_at;
for (int i = 0; i < size; ++i) to[i] = by[i] > 0.0f ? to[i] : 0.0f;
""")
def rectify(
    deltas: wp.array[float], deltas_at: int, made: wp.array[float], made_at: int, size: int
) -> None:
    """Set the gradient to 0 where the output of a ReLU is 0."""
    ...


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
    """Compute the outputs of all layers of frames `first` to `last` - 1; launch dimension 1."""
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
    """Compute gradients of frames `first` to `last` - 1, or of the weights; launch dimension 1."""
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
