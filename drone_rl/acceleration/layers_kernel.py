"""The layers of a small network on one core of a CPU, for kernels that ask it within a loop.

Libraries gain their speed on large batches. A kernel that flies a drone has a frame at a time, or
a handful; so here a layer is a product of matrices whose rows are read where they lie, be they
patches of a frame with its channels last or frames. Tiles of the product stay in registers,
which makes it twice as fast as oneDNN on one core. Each number is summed in the order of its
inputs, whatever is worked out beside it.
"""

import warp as wp

WIDTH = 16
"""Outputs that are worked out together: numbers of outputs are rounded up to a multiple of it."""

# Handed to a function, numbers make the compiler use registers of 512 bits where there are such; of
# itself it takes two of 256 for each, and half of the speed.
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
const float* input = given.data + given_at;
float* output = made.data + made_at;
const int panel = 16 * (1 + lines * length);
auto tile = [&](auto* shape, int row, int outs) __attribute__((always_inline)) {
    constexpr int ROWS = sizeof(*shape) / sizeof((*shape)[0]);
    constexpr int PARTS = sizeof((*shape)[0]) / sizeof(numbers);
    numbers sums[ROWS][PARTS];
    const float* from[ROWS];
    const float* now = weights.data + weights_at + outs / 16 * panel;
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
            if (is_rectified) sum = sum > 0.0f ? sum : numbers{};
            *(anywhere*)(output + (row + r) * made_down + outs + p * 16) = sum;
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


@wp.func_native(_TILES)
def multiply(
    given: wp.array[float],
    given_at: int,
    weights: wp.array[float],
    weights_at: int,
    made: wp.array[float],
    made_at: int,
    rows: int,
    columns: int,
    down: int,
    across: int,
    lines: int,
    length: int,
    next_line: int,
    num_outs: int,
    made_down: int,
    is_rectified: int,
) -> None:
    """A layer.

    Args:
        given: What it looks at.
        given_at: Where that begins.
        weights: Of `WIDTH` outputs at a time their biases, then for each input their weights.
        weights_at: Where these begin.
        made: Takes the outputs, row after row.
        made_at: Where these begin.
        rows: Places that it looks at: of a patch, or frames.
        columns: Of these in a line.
        down: How much farther each line of places begins.
        across: How much farther each place in a line begins.
        lines: Of a patch.
        length: Of a line of the patch.
        next_line: How much farther the patch's next line begins.
        num_outs: Of each row, a multiple of `WIDTH`.
        made_down: How much farther each row of outputs begins.
        is_rectified: Whether outputs below 0 become 0.
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
    """Copies so many numbers."""
    ...


@wp.struct
class Layers:
    """A network: convolutions, of one frame after the other, then layers of many at once."""

    steps: wp.array2d[int]
    """A row a layer: where it reads and writes in the room to work, and what `multiply` takes."""
    weights: wp.array[float]
    num_convolutions: int
    picture_size: int
    """Numbers that the convolutions leave of a frame."""
    logits_at: int
    """Where logits are in the room to work, `WIDTH` numbers a frame or a multiple of it."""
    num_outs: int
    """Of these for each frame."""
    outputs_at: wp.array[int]
    """Where those of each layer begin, where all of a frame are kept."""


@wp.func
def look(layers: Layers, picture: wp.array[float], room: wp.array[float], row: int) -> None:
    """What the convolutions make of a frame.

    Args:
        layers: The network.
        picture: Gray, pixel after pixel.
        room: To work in.
        row: Number of the frame among those that are decided on together.
    """
    for layer in range(layers.num_convolutions):
        made_at = layers.steps[layer, 1]
        if layer == layers.num_convolutions - 1:
            made_at += row * layers.picture_size
        if layer == 0:
            _apply(layers, layer, picture, 0, room, made_at, layers.steps[layer, 3])
        else:
            given_at = layers.steps[layer, 0]
            _apply(layers, layer, room, given_at, room, made_at, layers.steps[layer, 3])


@wp.func
def decide(layers: Layers, room: wp.array[float], count: int) -> None:
    """Logits of the frames that were looked at.

    Args:
        layers: The network.
        room: To work in.
        count: Of frames.
    """
    for layer in range(layers.num_convolutions, layers.steps.shape[0]):
        given_at, made_at = layers.steps[layer, 0], layers.steps[layer, 1]
        _apply(layers, layer, room, given_at, room, made_at, count)


@wp.func
def keep(
    layers: Layers, first: int, last: int, room: wp.array[float], row: int, outputs: wp.array[float]
) -> None:
    """Copies what layers made of a frame, before the next one takes their room.

    Args:
        layers: The network.
        first: The first of the layers.
        last: The one after the last.
        room: Where they worked.
        row: Number of the frame among those that are decided on together.
        outputs: Takes them.
    """
    for layer in range(first, last):
        size = layers.steps[layer, 3] * layers.steps[layer, 10]
        at = layers.steps[layer, 1]
        if layer >= layers.num_convolutions - 1:
            at += row * size
        copy(room, at, outputs, layers.outputs_at[layer], size)


@wp.func
def _apply(
    layers: Layers,
    layer: int,
    given: wp.array[float],
    given_at: int,
    made: wp.array[float],
    made_at: int,
    rows: int,
) -> None:
    multiply(
        given,
        given_at,
        layers.weights,
        layers.steps[layer, 2],
        made,
        made_at,
        rows,
        layers.steps[layer, 4],
        layers.steps[layer, 5],
        layers.steps[layer, 6],
        layers.steps[layer, 7],
        layers.steps[layer, 8],
        layers.steps[layer, 9],
        layers.steps[layer, 10],
        layers.steps[layer, 10],
        layers.steps[layer, 11],
    )
