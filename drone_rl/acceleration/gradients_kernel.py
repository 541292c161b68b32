"""From the gradient of a small network's logits to that of its weights, or frames, on a CPU.

A block of frames at a time goes back through all layers, on one core, so that what is read again
is still near.
"""

import warp as wp

from drone_rl.acceleration.layers_backward_kernel import accumulate, fold, rectify
from drone_rl.acceleration.layers_kernel import copy, multiply

BLOCK = wp.constant(64)
"""Frames at a time."""


@wp.struct
class PackedParams:
    """A network that learns."""

    geometry: wp.array2d[int]
    """A row a layer: what `multiply` takes from `rows` to `num_outs`."""
    weights_at: wp.array[int]
    """Where those of each layer begin."""
    weights: wp.array[float]
    back_at: wp.array[int]
    """Where those of each layer the other way begin."""
    back: wp.array[float]
    made_at: wp.array[int]
    """Where the outputs of each layer begin among those of a frame, and where these end."""
    num_convolutions: int
    near: int
    """How much farther each frame's inputs of linear layers begin, once they are side by side."""


@wp.kernel
def answer(
    first: int,
    last: int,
    params: PackedParams,
    pictures: wp.array2d[float],
    made: wp.array[float],
) -> None:
    """Outputs of all layers for a share of the frames.

    Args:
        first: The first frame.
        last: The one after the last: launch it with a dimension of 1.
        params: The network.
        pictures: Gray. Shape: (frames, pixels).
        made: Takes the outputs: of each frame those of all layers.
    """
    size = _size(params)
    num_layers = params.geometry.shape[0]
    for block in range(first, last, BLOCK):
        end = wp.min(block + BLOCK, last)
        for picture in range(block, end):
            for layer in range(params.num_convolutions):
                to = picture * size + params.made_at[layer]
                rows = params.geometry[layer, 0]
                down = params.geometry[layer, 2]
                outs = params.geometry[layer, 7]
                if layer == 0:
                    _forward(params, layer, pictures[picture], 0, made, to, rows, down, outs)
                else:
                    at = picture * size + params.made_at[layer - 1]
                    _forward(params, layer, made, at, made, to, rows, down, outs)
        for layer in range(params.num_convolutions, num_layers):
            at = block * size + params.made_at[layer - 1]
            to = block * size + params.made_at[layer]
            _forward(params, layer, made, at, made, to, end - block, size, size)


@wp.func
def _size(params: PackedParams) -> int:
    """Room that the outputs of a frame take."""
    return params.made_at[params.geometry.shape[0]]


@wp.func
def _stride(params: PackedParams, layer: int) -> int:
    """Room that those of a layer take."""
    return params.made_at[layer + 1] - params.made_at[layer]


@wp.func
def _forward(
    params: PackedParams,
    layer: int,
    given: wp.array[float],
    given_at: int,
    made: wp.array[float],
    made_at: int,
    rows: int,
    down: int,
    made_down: int,
) -> None:
    multiply(
        given,
        given_at,
        params.weights,
        params.weights_at[layer],
        made,
        made_at,
        rows,
        params.geometry[layer, 1],
        down,
        params.geometry[layer, 3],
        params.geometry[layer, 4],
        params.geometry[layer, 5],
        params.geometry[layer, 6],
        params.geometry[layer, 7],
        made_down,
        wp.where(layer < params.geometry.shape[0] - 1, 1, 0),
    )


@wp.kernel
def learn(
    first: int,
    last: int,
    member: int,
    params: PackedParams,
    pictures: wp.array2d[float],
    made: wp.array[float],
    rows: wp.array[int],
    grad_output: wp.array2d[float],
    rooms: wp.array2d[float],
    sides: wp.array2d[float],
    patches: wp.array2d[float],
    gradients: wp.array2d[float],
    seen: wp.array2d[float],
) -> None:
    """What a share of the frames, or the weights, have to do with the logits.

    Args:
        first: The first frame.
        last: The one after the last: launch it with a dimension of 1.
        member: Which of the rooms to work in, and which gradients to add to.
        params: The network.
        pictures: Gray. Shape: (frames, pixels).
        made: Outputs, as `answer` writes them.
        rows: Which of them each frame has.
        grad_output: Gradient of the logits. Shape: (frames, actions).
        rooms: For gradients of outputs, one a member.
        sides: For inputs of linear layers, of a block's frames side by side, one a member.
        patches: For those of inputs of one convolution, one a member.
        gradients: Of the weights, to be added to, one a member; or of shape (0, 0).
        seen: Gradient of the frames, to be written; or of shape (0, 0).
    """
    room = rooms[member]
    total = room
    if gradients.shape[0] > 0:
        total = gradients[member]
    side = sides[member]
    top = params.geometry.shape[0] - 1
    for block in range(first, last, BLOCK):
        end = wp.min(block + BLOCK, last)
        for picture in range(block, end):
            _begin(params, picture, picture - block, made, rows, grad_output[picture], room, side)
        for down in range(top + 1):
            layer = top - down
            if gradients.shape[0] > 0:
                _notice(params, layer, block, end, pictures, made, rows, side, room, total)
            if layer >= params.num_convolutions:
                _linear(params, layer, end - block, side, room)
            else:
                for picture in range(block, end):
                    _convolution(
                        params, layer, picture, block, made, rows, room, patches[member], seen
                    )


@wp.func
def _begin(
    params: PackedParams,
    picture: int,
    number: int,
    made: wp.array[float],
    rows: wp.array[int],
    grad_output: wp.array[float],
    room: wp.array[float],
    side: wp.array[float],
) -> None:
    """Writes the gradient of a frame's logits, of those that fill up 0, and its linear inputs."""
    inputs_at = params.made_at[params.num_convolutions - 1]
    top = params.geometry.shape[0] - 1
    given_at = rows[picture] * _size(params) + inputs_at
    copy(made, given_at, side, number * params.near, params.made_at[top] - inputs_at)
    at = BLOCK * params.made_at[top] + number * _stride(params, top)
    for action in range(params.geometry[top, 7]):
        slope = float(0.0)
        if action < grad_output.shape[0]:
            slope = grad_output[action]
        room[at + action] = slope


@wp.func
def _notice(
    params: PackedParams,
    layer: int,
    block: int,
    end: int,
    pictures: wp.array2d[float],
    made: wp.array[float],
    rows: wp.array[int],
    side: wp.array[float],
    room: wp.array[float],
    gradients: wp.array[float],
) -> None:
    """Adds to the gradient of a layer's weights."""
    deltas_at = BLOCK * params.made_at[layer]
    stride = _stride(params, layer)
    count = end - block
    if layer >= params.num_convolutions:
        at = params.made_at[layer - 1] - params.made_at[params.num_convolutions - 1]
        near = params.near
        _add(params, layer, side, at, room, deltas_at, gradients, count, count, 0, near)
        return
    places = params.geometry[layer, 0]
    columns = params.geometry[layer, 1]
    down = params.geometry[layer, 2]
    across = params.geometry[layer, 3]
    for picture in range(block, end):
        by = deltas_at + (picture - block) * stride
        if layer == 0:
            given = pictures[picture]
            _add(params, layer, given, 0, room, by, gradients, places, columns, down, across)
        else:
            at = rows[picture] * _size(params) + params.made_at[layer - 1]
            _add(params, layer, made, at, room, by, gradients, places, columns, down, across)


@wp.func
def _add(
    params: PackedParams,
    layer: int,
    given: wp.array[float],
    given_at: int,
    room: wp.array[float],
    deltas_at: int,
    gradients: wp.array[float],
    rows: int,
    columns: int,
    down: int,
    across: int,
) -> None:
    outs = params.geometry[layer, 7]
    accumulate(
        given,
        given_at,
        room,
        deltas_at,
        gradients,
        params.weights_at[layer],
        rows,
        columns,
        down,
        across,
        params.geometry[layer, 4],
        params.geometry[layer, 5],
        params.geometry[layer, 6],
        outs,
        wp.where(layer < params.num_convolutions, outs, _stride(params, layer)),
    )


@wp.func
def _linear(
    params: PackedParams, layer: int, count: int, side: wp.array[float], room: wp.array[float]
) -> None:
    """From the gradient of a linear layer's outputs to that of its inputs."""
    size = params.geometry[layer, 5]
    stride = _stride(params, layer - 1)
    before_at = BLOCK * params.made_at[layer - 1]
    _back(
        params,
        layer,
        room,
        BLOCK * params.made_at[layer],
        room,
        before_at,
        count,
        _stride(params, layer),
        size,
        stride,
    )
    given_at = params.made_at[layer - 1] - params.made_at[params.num_convolutions - 1]
    for row in range(count):
        rectify(room, before_at + row * stride, side, given_at + row * params.near, size)


@wp.func
def _convolution(
    params: PackedParams,
    layer: int,
    picture: int,
    block: int,
    made: wp.array[float],
    rows: wp.array[int],
    room: wp.array[float],
    patches: wp.array[float],
    seen: wp.array2d[float],
) -> None:
    """The same of a convolution and one frame; the first is asked only if that is wanted."""
    if layer == 0 and seen.shape[0] == 0:
        return
    outs = params.geometry[layer, 7]
    size = params.geometry[layer, 4] * params.geometry[layer, 5]
    deltas_at = BLOCK * params.made_at[layer] + (picture - block) * _stride(params, layer)
    places = params.geometry[layer, 0]
    _back(params, layer, room, deltas_at, patches, 0, places, outs, size, size)
    if layer == 0:
        _fold(params, layer, patches, seen[picture], 0, seen.shape[1])
        return
    before = layer - 1
    before_at = BLOCK * params.made_at[before] + (picture - block) * _stride(params, before)
    num_made = params.geometry[before, 0] * params.geometry[before, 7]
    _fold(params, layer, patches, room, before_at, num_made)
    given_at = rows[picture] * _size(params) + params.made_at[before]
    rectify(room, before_at, made, given_at, num_made)


@wp.func
def _back(
    params: PackedParams,
    layer: int,
    deltas: wp.array[float],
    deltas_at: int,
    made: wp.array[float],
    made_at: int,
    rows: int,
    down: int,
    num_outs: int,
    made_down: int,
) -> None:
    outs = params.geometry[layer, 7]
    multiply(
        deltas,
        deltas_at,
        params.back,
        params.back_at[layer],
        made,
        made_at,
        rows,
        1,
        down,
        0,
        1,
        outs,
        0,
        num_outs,
        made_down,
        0,
    )


@wp.func
def _fold(
    params: PackedParams,
    layer: int,
    patches: wp.array[float],
    made: wp.array[float],
    made_at: int,
    size: int,
) -> None:
    fold(
        patches,
        made,
        made_at,
        size,
        params.geometry[layer, 0],
        params.geometry[layer, 1],
        params.geometry[layer, 2],
        params.geometry[layer, 3],
        params.geometry[layer, 4],
        params.geometry[layer, 5],
        params.geometry[layer, 6],
    )
