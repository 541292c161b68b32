"""Layers of a small network on one core of a CPU, for kernels that evaluate it within a loop.

Libraries gain their speed on large batches; a kernel that runs an episode has one frame at a time,
or a few. A layer is therefore a matrix product whose rows are read in place: patches of a frame
with its channels first, of outputs with their channels last, or whole vectors. Tiles of the product
stay in registers, which makes it twice as fast as oneDNN on one core. Each output is summed in the
order of its inputs, so it does not depend on the batch.
"""

import warp as wp

WIDTH = 16
"""Number of outputs that are computed together. Layers are padded to a multiple of it.

The C++ code below and in `gradients_kernel` has the same number, 16, and vectors of 64 bytes.
"""

# `add` takes vectors as arguments because clang then uses a 512-bit register for each, where there
# are any; otherwise it splits them in two, at half the speed.
PREAMBLE = """
#pragma clang fp contract(fast)
#pragma clang diagnostic ignored "-Wpsabi"
typedef float numbers __attribute__((vector_size(64)));
typedef float anywhere __attribute__((vector_size(64), aligned(4)));
auto add = [](numbers sum, float by, numbers values) __attribute__((always_inline)) {
    return sum + by * values;
};
const int num_patches = g.num_patches, columns = g.patches_per_row, num_outs = g.num_outs;
const int row_stride = g.row_stride, column_stride = g.column_stride;
const int kernel_rows = g.kernel_rows, length = g.kernel_row_length;
const int kernel_row_stride = g.kernel_row_stride, planes = g.num_planes;
const int panel = 16 * (1 + planes * kernel_rows * length);
const float* input = inputs.data + g.input_offset;
"""
"""C++ declarations that functions share: vectors of 16 floats, and the fields of `g`.

A function that begins with it has the parameters `inputs` and `g`.
"""

_TILES = (
    PREAMBLE
    + """
float* output = outputs.data + g.output_offset;
auto tile = [&](auto* shape, int patch, int outs) __attribute__((always_inline)) {
    constexpr int PATCHES = sizeof(*shape) / sizeof((*shape)[0]);
    constexpr int PARTS = sizeof((*shape)[0]) / sizeof(numbers);
    numbers sums[PATCHES][PARTS];
    const float* from[PATCHES];
    const float* now = weights.data + g.weights_offset + outs / 16 * panel;
    int column = patch % columns;
    const float* first = input + patch / columns * row_stride + column * column_stride;
    #pragma unroll
    for (int r = 0; r < PATCHES; ++r) {
        from[r] = first;
        bool is_last = ++column == columns;
        first += is_last ? row_stride - (columns - 1) * column_stride : column_stride;
        column = is_last ? 0 : column;
        #pragma unroll
        for (int p = 0; p < PARTS; ++p) sums[r][p] = *(const anywhere*)(now + p * panel);
    }
    for (int plane = 0; plane < planes; ++plane) {
        for (int row = 0; row < kernel_rows; ++row) {
            for (int i = 0; i < length; ++i) {
                now += 16;
                #pragma unroll
                for (int r = 0; r < PATCHES; ++r) {
                    #pragma unroll
                    for (int p = 0; p < PARTS; ++p) {
                        numbers by = *(const anywhere*)(now + p * panel);
                        sums[r][p] = add(sums[r][p], from[r][i], by);
                    }
                }
            }
            #pragma unroll
            for (int r = 0; r < PATCHES; ++r) from[r] += kernel_row_stride;
        }
        #pragma unroll
        for (int r = 0; r < PATCHES; ++r) from[r] += g.plane_skip;
    }
    #pragma unroll
    for (int r = 0; r < PATCHES; ++r) {
        #pragma unroll
        for (int p = 0; p < PARTS; ++p) {
            numbers sum = sums[r][p];
            if (g.is_rectified) sum = sum > 0.0f ? sum : numbers{};
            *(anywhere*)(output + (patch + r) * g.output_stride + outs + p * 16) = sum;
        }
    }
};
auto cover = [&](auto* many, auto* one, int outs) __attribute__((always_inline)) {
    constexpr int PATCHES = sizeof(*many) / sizeof(*one);
    int patch = 0;
    for (; patch + PATCHES <= num_patches; patch += PATCHES) tile(many, patch, outs);
    for (; patch < num_patches; ++patch) tile(one, patch, outs);
};
// The sums of a tile take at most half of the vector registers; the rest holds weights and inputs.
int outs = 0;
#ifdef __AVX512F__
typedef numbers eight_by_two[8][2];
typedef numbers one_by_two[1][2];
for (; outs + 32 <= num_outs; outs += 32) cover((eight_by_two*)nullptr, (one_by_two*)nullptr, outs);
typedef numbers many_by_one[8][1];
#else
typedef numbers many_by_one[4][1];
#endif
typedef numbers one_by_one[1][1];
for (; outs < num_outs; outs += 16) cover((many_by_one*)nullptr, (one_by_one*)nullptr, outs);
"""
)


@wp.struct
class LayerGeometry:
    """Geometry of a layer: a matrix product whose rows are patches of a frame, or vectors."""

    input_offset: int
    weights_offset: int
    output_offset: int
    num_patches: int
    """Patches, or vectors of a linear layer; a multiple of `patches_per_row`."""
    patches_per_row: int
    row_stride: int
    """Stride between two rows of patches."""
    column_stride: int
    """Stride between two patches of a row."""
    kernel_rows: int
    """Rows of a patch."""
    kernel_row_length: int
    """Numbers in a row of a patch."""
    kernel_row_stride: int
    """Stride between two rows of a patch."""
    num_planes: int
    """Parts of a patch that are not side by side: channels of a frame, one after the other."""
    plane_skip: int
    """From the end of a part's last row of a patch to the first row of the next part."""
    num_outs: int
    """Outputs of a patch with padding, a multiple of `WIDTH`."""
    output_stride: int
    """Stride between the outputs of two patches."""
    is_rectified: int
    """Whether outputs below 0 become 0."""
    pool_size: int
    """Rows and columns of outputs of which one is kept, their maximum; 0 to keep all outputs."""
    pooled_offset: int
    """Where they are kept."""


@wp.func_native(_TILES)
def multiply(
    inputs: wp.array[float], weights: wp.array[float], outputs: wp.array[float], g: LayerGeometry
) -> None:
    """Compute a layer.

    `weights` are, for each `WIDTH` outputs, their biases, then for each input their weights.
    """
    ...


@wp.func_native("""
const int columns = g.patches_per_row / g.pool_size, stride = g.output_stride;
const int rows = g.num_patches / g.patches_per_row / g.pool_size;
float* to = values.data + g.pooled_offset;
for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column, to += stride) {
        const int first = g.pool_size * (row * g.patches_per_row + column);
        const float* from = values.data + g.output_offset + first * stride;
        for (int i = 0; i < stride; ++i) to[i] = from[i];
        for (int y = 0; y < g.pool_size; ++y) {
            for (int x = 0; x < g.pool_size; ++x) {
                const float* by = from + (y * g.patches_per_row + x) * stride;
                for (int i = 0; i < stride; ++i) to[i] = by[i] > to[i] ? by[i] : to[i];
            }
        }
    }
}
""")
def pool(values: wp.array[float], g: LayerGeometry) -> None:
    """Keep the maximum of each square of outputs, as `torch.nn.MaxPool2d(g.pool_size)` does."""
    ...


@wp.func_native("""
const float* from = source.data + source_at;
float* to = target.data + target_at;
for (int i = 0; i < size; ++i) to[i] = from[i];
""")
def copy(
    source: wp.array[float], source_at: int, target: wp.array[float], target_at: int, size: int
) -> None:
    """Copy numbers."""
    ...


@wp.struct
class Layers:
    """A network, and where the outputs of each layer are in the row of a frame."""

    geometries: wp.array[LayerGeometry]
    """Without offsets of inputs and outputs, but with those of numbers in an observation."""
    weights: wp.array[float]
    output_offsets: wp.array[int]
    """Offset of each layer's outputs before pooling; last, the size of a row."""
    kept_offsets: wp.array[int]
    """Offset of each layer's outputs after pooling, which are the inputs of the next layer."""
    starts: wp.array[int]
    """See `OutputOffsets`, also for what follows."""
    strides: wp.array[int]
    sources: wp.array[int]
    """Number of the layer whose outputs are the inputs; -1 for the observation."""
    num_branch_layers: int
    """Layers that take one observation at a time; the linear ones of the trunk follow."""


@wp.func
def row_size(layers: Layers) -> int:
    """Return the numbers of a row: the outputs of all layers for one frame, with padding."""
    return layers.output_offsets[layers.geometries.shape[0]]


@wp.func
def run_branches(
    layers: Layers, observation: wp.array[float], outputs: wp.array[float], row: int
) -> None:
    """Compute the features of one observation: images, channels first, then vectors."""
    at = row * row_size(layers)
    for layer in range(layers.num_branch_layers):
        g = layers.geometries[layer]
        g.output_offset = at + layers.output_offsets[layer]
        source = layers.sources[layer]
        if source < 0:
            multiply(observation, layers.weights, outputs, g)
        else:
            g.input_offset = at + layers.kept_offsets[source]
            multiply(outputs, layers.weights, outputs, g)
        if g.pool_size > 0:
            g.pooled_offset = at + layers.kept_offsets[layer]
            pool(outputs, g)


@wp.func
def run_trunk(layers: Layers, outputs: wp.array[float], first: int, count: int) -> None:
    """Compute the outputs of the trunk for `count` observations, from row `first` on, at once."""
    size = row_size(layers)
    for layer in range(layers.num_branch_layers, layers.geometries.shape[0]):
        g = layers.geometries[layer]
        g.input_offset = first * size + layers.kept_offsets[layers.sources[layer]]
        g.output_offset = first * size + layers.output_offsets[layer]
        g.num_patches = count
        g.row_stride = size
        g.output_stride = size
        multiply(outputs, layers.weights, outputs, g)
