"""Gradients of a layer on one core of a CPU: of its weights, and of its inputs.

The gradient of the weights is tiled as in `layers_kernel`. That of the inputs begins with the
product there, with the weights transposed.
"""

import warp as wp

from drone_rl.acceleration.layers_kernel import NUMBERS, Product

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
    """Add to the gradient of a layer's weights.

    `given` are its inputs, `deltas` the gradient of its outputs, `g` its geometry.
    """
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
