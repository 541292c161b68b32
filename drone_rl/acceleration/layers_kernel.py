"""Layers of a small network on one core of a CPU, for kernels that evaluate it within a loop.

Libraries gain their speed on large batches; a kernel that runs an episode has one frame at a time,
or a few. A layer is therefore a matrix product whose rows are read in place: patches of a frame
with its channels last, or whole vectors. Tiles of the product stay in registers, which makes it
twice as fast as oneDNN on one core. Each output is summed in the order of its inputs, whatever is
computed next to it.
"""

import warp as wp

WIDTH = 16
"""Outputs that are computed together: numbers of outputs are rounded up to a multiple of it."""

# As arguments of a function, vectors make the compiler use 512-bit registers where there are any;
# otherwise it takes two of 256 bits for each, at half the speed.
NUMBERS = """
#pragma clang fp contract(fast)
#pragma clang diagnostic ignored "-Wpsabi"
typedef float numbers __attribute__((vector_size(64)));
typedef float anywhere __attribute__((vector_size(64), aligned(4)));
auto add = [](numbers sum, float by, numbers given) __attribute__((always_inline)) {
    return sum + by * given;
};
"""
"""Sixteen numbers at a time, for functions in C++."""

_TILES = (
    NUMBERS
    + """
const int rows = g.rows, columns = g.columns, down = g.down, across = g.across;
const int lines = g.lines, length = g.length, next_line = g.next_line, num_outs = g.num_outs;
const float* input = given.data + g.given_at;
float* output = made.data + g.made_at;
const int panel = 16 * (1 + lines * length);
auto tile = [&](auto* shape, int row, int outs) __attribute__((always_inline)) {
    constexpr int ROWS = sizeof(*shape) / sizeof((*shape)[0]);
    constexpr int PARTS = sizeof((*shape)[0]) / sizeof(numbers);
    numbers sums[ROWS][PARTS];
    const float* from[ROWS];
    const float* now = weights.data + g.weights_at + outs / 16 * panel;
    int column = row % columns;
    const float* first = input + row / columns * down + column * across;
    #pragma unroll
    for (int r = 0; r < ROWS; ++r) {
        from[r] = first;
        bool is_last = ++column == columns;
        first += is_last ? down - (columns - 1) * across : across;
        column = is_last ? 0 : column;
        #pragma unroll
        for (int p = 0; p < PARTS; ++p) sums[r][p] = *(const anywhere*)(now + p * panel);
    }
    for (int line = 0; line < lines; ++line) {
        for (int i = 0; i < length; ++i) {
            now += 16;
            #pragma unroll
            for (int r = 0; r < ROWS; ++r) {
                #pragma unroll
                for (int p = 0; p < PARTS; ++p)
                    sums[r][p] = add(sums[r][p], from[r][i], *(const anywhere*)(now + p * panel));
            }
        }
        #pragma unroll
        for (int r = 0; r < ROWS; ++r) from[r] += next_line;
    }
    #pragma unroll
    for (int r = 0; r < ROWS; ++r) {
        #pragma unroll
        for (int p = 0; p < PARTS; ++p) {
            numbers sum = sums[r][p];
            if (g.is_rectified) sum = sum > 0.0f ? sum : numbers{};
            *(anywhere*)(output + (row + r) * g.made_down + outs + p * 16) = sum;
        }
    }
};
auto cover = [&](auto* many, auto* one, int outs) __attribute__((always_inline)) {
    constexpr int ROWS = sizeof(*many) / sizeof(*one);
    int row = 0;
    for (; row + ROWS <= rows; row += ROWS) tile(many, row, outs);
    for (; row < rows; ++row) tile(one, row, outs);
};
// As many as there are registers for: 32 of 16 numbers, or 16 of 8.
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
class Product:
    """Geometry of a layer: a matrix product whose rows are patches of a frame, or vectors."""

    given_at: int
    """Offset of the inputs."""
    weights_at: int
    """Offset of the weights."""
    made_at: int
    """Offset of the outputs."""
    rows: int
    """Patches, or vectors."""
    columns: int
    """Patches in a line of patches; rows are a multiple of it."""
    down: int
    """Stride from a line of patches to the next."""
    across: int
    """Stride from a patch to the next of its line."""
    lines: int
    """Lines of a patch."""
    length: int
    """Numbers in a line of a patch."""
    next_line: int
    """Stride from a line of a patch to the next."""
    num_outs: int
    """Outputs of a row, a multiple of `WIDTH`."""
    made_down: int
    """Stride from the outputs of a row to those of the next."""
    is_rectified: int
    """Whether outputs below 0 become 0."""


@wp.func_native(_TILES)
def multiply(
    given: wp.array[float], weights: wp.array[float], made: wp.array[float], g: Product
) -> None:
    """Compute a layer.

    `weights` are, for each `WIDTH` outputs, their biases, then for each input their weights.
    """
    ...


@wp.func_native("""
const float* from = given.data + given_at;
float* to = made.data + made_at;
for (int i = 0; i < size; ++i) to[i] = from[i];
""")
def copy(
    given: wp.array[float], given_at: int, made: wp.array[float], made_at: int, size: int
) -> None:
    """Copy numbers."""
    ...


@wp.struct
class Layers:
    """A network: convolutions, of one frame after the other, then layers of several at once."""

    products: wp.array[Product]
    """One for each layer; offsets are those in a workspace."""
    weights: wp.array[float]
    num_convolutions: int
    features_size: int
    """Numbers that the convolutions make of a frame."""
    logits_at: int
    """Offset of the logits in a workspace."""
    num_outs: int
    """Stride from the logits of a frame to those of the next."""
    outputs_at: wp.array[int]
    """Offset of each layer where the outputs of all layers of a frame are saved."""


@wp.func
def run_convolutions(
    layers: Layers, frame: wp.array[float], workspace: wp.array[float], row: int
) -> None:
    """Compute the convolutions of one frame of gray pixels.

    `row` is its number among the frames whose linear layers are computed together.
    """
    for layer in range(layers.num_convolutions):
        p = layers.products[layer]
        if layer == layers.num_convolutions - 1:
            p.made_at += row * layers.features_size
        if layer == 0:
            multiply(frame, layers.weights, workspace, p)
        else:
            multiply(workspace, layers.weights, workspace, p)


@wp.func
def run_linear(layers: Layers, workspace: wp.array[float], count: int) -> None:
    """Compute the linear layers of the first `count` frames."""
    for layer in range(layers.num_convolutions, layers.products.shape[0]):
        p = layers.products[layer]
        p.rows = count
        multiply(workspace, layers.weights, workspace, p)


@wp.func
def save_outputs(
    layers: Layers,
    first: int,
    last: int,
    workspace: wp.array[float],
    row: int,
    outputs: wp.array[float],
) -> None:
    """Copy the outputs of layers `first` to `last` - 1 of one frame out of the workspace."""
    for layer in range(first, last):
        p = layers.products[layer]
        size = p.rows * p.num_outs
        if layer >= layers.num_convolutions - 1:
            p.made_at += row * size
        copy(workspace, p.made_at, outputs, layers.outputs_at[layer], size)
