"""Packing of weights for kernels, and unpacking of gradients."""

import torch

from drone_rl.acceleration.layers_kernel import WIDTH
from drone_rl.acceleration.packed_layers import (
    Order,
    OutputOffsets,
    PackedLayer,
    in_panels,
    odd_lines,
    packed_layers,
)
from drone_rl.policies import OriginalCNN, SmallCNN


def small():
    network = SmallCNN((1, 8, 8), 3, patch=4, channels=(2,), hidden=(5,))
    return network, packed_layers(network)


def test_geometry_matches_hand_computed_values():
    _, (conv, hidden, logits) = small()
    # 2x2 positions; the row stride is 4 rows of 8 pixels, the column stride 4 pixels
    names = ("num_patches", "patches_per_row", "row_stride", "column_stride", "kernel_rows")
    names += ("kernel_row_length", "kernel_row_stride", "num_outs", "output_stride", "pool_size")
    assert conv.geometry == dict(zip(names, (4, 2, 32, 4, 4, 4, 8, 16, 16, 0), strict=True))
    # 2x2 positions of 16 channels
    assert hidden.geometry == dict(zip(names, (1, 1, 64, 16, 1, 64, 0, 16, 16, 0), strict=True))
    assert logits.geometry == dict(zip(names, (1, 1, 16, 16, 1, 16, 0, 16, 16, 0), strict=True))
    assert [layer.output_size for layer in (conv, hidden, logits)] == [64, 16, 16]
    assert [layer.is_convolution for layer in (conv, hidden, logits)] == [True, False, False]


def test_outputs_take_an_odd_number_of_cache_lines():
    assert [odd_lines(n) for n in (1, 16, 17, 32, 33, 1792)] == [16, 16, 48, 48, 48, 1808]
    _, layers = small()
    # five cache lines, one and one
    assert OutputOffsets.of(layers) == ([0, 80, 96, 112], [0, 80, 96])
    assert OutputOffsets.of(layers[:2]).outputs == [0, 80, 112]  # five and one, and an empty one


def test_outputs_after_pooling_follow_those_before():
    layers = packed_layers(OriginalCNN((1, 10, 12), 3, channels=(2,), hidden=()))
    # 6x8 and 3x4 positions of 16 channels: 48 and 12 cache lines, and one more of each
    assert OutputOffsets.of(layers) == ([0, 16 * (49 + 13), 16 * (49 + 13 + 1)], [16 * 49, 992])
    assert layers[0].pooled_shape == (3, 4) and layers[1].num_inputs == 3 * 4 * 16


def test_order_matches_hand_computed_indices():
    layer = PackedLayer(torch.nn.Conv2d(2, 3, (1, 2)), 2, (1, 2, 2), (1, 2), 1)
    order = layer.order(10)
    assert order.shape == (1 + 4, WIDTH)
    # 12 weights from index 10, at 10 + 4 o + 2 c + w for output o, channel c, column w; 3 biases
    assert order[0].tolist() == [22, 23, 24] + [0] * 13
    assert order[1:, 0].tolist() == [10, 12, 11, 13] and order[1:, 2].tolist() == [18, 20, 19, 21]
    assert not order[:, 3:].any()


def test_panels_hold_sixteen_columns_each():
    by_row = torch.arange(3 * 2 * WIDTH).view(3, -1)
    panels = in_panels(by_row).view(2, 3, WIDTH)
    assert torch.equal(panels[0], by_row[:, :WIDTH]) and torch.equal(panels[1], by_row[:, WIDTH:])


def test_unpacking_inverts_packing():
    network, layers = small()
    order = Order(layers)
    weights, transposed = (
        torch.full((order.weight_offsets[-1],), 7.0),
        torch.full((order.transposed_offsets[-1],), 7.0),
    )
    order.pack(weights, transposed)
    parameters = [p.detach() for layer in layers for p in layer.parameters]
    assert {p.data_ptr() for p in parameters} == {p.data_ptr() for p in network.parameters()}
    for unpacked, parameter in zip(order.unpack(weights), parameters, strict=True):
        assert torch.equal(unpacked, parameter)
    count = sum(p.numel() for p in parameters)
    assert (weights != 0).sum() == sum(int((p != 0).sum()) for p in parameters) <= count


def test_backward_weights_are_transposed():
    _, layers = small()
    order = Order(layers)
    weights, transposed = (
        torch.zeros(order.weight_offsets[-1]),
        torch.zeros(order.transposed_offsets[-1]),
    )
    order.pack(weights, transposed)
    for i, layer in list(enumerate(layers))[1:]:
        there = weights[order.weight_offsets[i] : order.weight_offsets[i + 1]]
        there = there.view(-1, 1 + layer.num_inputs, WIDTH)  # a panel
        turned = transposed[order.transposed_offsets[i] : order.transposed_offsets[i + 1]].view(
            -1, 1 + layer.num_outs, WIDTH
        )
        assert not turned[:, 0].any()
        by_row = there.transpose(0, 1).reshape(1 + layer.num_inputs, -1)[1:]
        assert torch.equal(turned[:, 1:].transpose(0, 1).reshape(layer.num_outs, -1), by_row.T)
