"""The way back through a layer on one core of a CPU: to its weights, and to its inputs.

Tiles of the first are as in `layers_kernel`; its product, with the weights the other way round, is
the beginning of the second.
"""

import warp as wp

from drone_rl.acceleration.layers_kernel import NUMBERS

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
const float* input = given.data + given_at;
const float* delta = deltas.data + deltas_at;
const int panel = 16 * (1 + lines * length);
auto tile = [&](auto* shape, int line, int i, int outs) __attribute__((always_inline)) {
    constexpr int INPUTS = sizeof(*shape) / sizeof(numbers);
    float* told = gradients.data + gradients_at + outs / 16 * panel + (1 + line * length + i) * 16;
    numbers sums[INPUTS];
    #pragma unroll
    for (int k = 0; k < INPUTS; ++k) sums[k] = *(const anywhere*)(told + k * 16);
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
    for (int k = 0; k < INPUTS; ++k) *(anywhere*)(told + k * 16) = sums[k];
};
for (int outs = 0; outs < num_outs; outs += 16) {
    anywhere* told = (anywhere*)(gradients.data + gradients_at + outs / 16 * panel);
    numbers sum = *told;
    const float* by = delta + outs;
    for (int row = 0; row < rows; ++row, by += deltas_down) sum += *(const anywhere*)by;
    *told = sum;
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
    given: wp.array[float],
    given_at: int,
    deltas: wp.array[float],
    deltas_at: int,
    gradients: wp.array[float],
    gradients_at: int,
    rows: int,
    columns: int,
    down: int,
    across: int,
    lines: int,
    length: int,
    next_line: int,
    num_outs: int,
    deltas_down: int,
) -> None:
    """Adds to the gradient of a layer's weights.

    Args:
        given: What the layer looked at.
        given_at: Where that begins.
        deltas: Gradient of its outputs, row after row.
        deltas_at: Where that begins.
        gradients: Gradient of the weights, in their order, to be added to.
        gradients_at: Where that begins.
        rows: As for `multiply`, and those that follow; rows are a multiple of the columns.
        columns: Of these in a line.
        down: How much farther each line of places begins.
        across: How much farther each place in a line begins.
        lines: Of a patch.
        length: Of a line of the patch.
        next_line: How much farther the patch's next line begins.
        num_outs: Of each row.
        deltas_down: How much farther each row of deltas begins.
    """
    ...


@wp.func_native("""
#pragma clang fp contract(off)
float* to = made.data + made_at;
for (int i = 0; i < size; ++i) to[i] = 0.0f;
const float* from = patches.data;
for (int row = 0; row < rows; ++row) {
    float* patch = to + row / columns * down + row % columns * across;
    for (int line = 0; line < lines; ++line) {
        for (int i = 0; i < length; ++i) patch[i] += from[i];
        patch += next_line;
        from += length;
    }
}
""")
def fold(
    patches: wp.array[float],
    made: wp.array[float],
    made_at: int,
    size: int,
    rows: int,
    columns: int,
    down: int,
    across: int,
    lines: int,
    length: int,
    next_line: int,
) -> None:
    """Adds patches up where they lie.

    Args:
        patches: One a row.
        made: To write.
        made_at: Where it begins.
        size: Of what is written.
        rows: As for `multiply`, and those that follow.
        columns: Of these in a line.
        down: How much farther each line of places begins.
        across: How much farther each place in a line begins.
        lines: Of a patch.
        length: Of a line of the patch.
        next_line: How much farther the patch's next line begins.
    """
    ...


@wp.func_native("""
float* to = deltas.data + deltas_at;
const float* by = made.data + made_at;
for (int i = 0; i < size; ++i) to[i] = by[i] > 0.0f ? to[i] : 0.0f;
""")
def rectify(
    deltas: wp.array[float], deltas_at: int, made: wp.array[float], made_at: int, size: int
) -> None:
    """Nothing goes back to where nothing came from."""
    ...
