"""A packed network gives the same logits as the network, also after updates."""

import pytest
import torch
import warp as wp
from torch import nn

from drone_rl.acceleration.layers_kernel import WIDTH, Layers, run_branches, run_trunk
from drone_rl.acceleration.packed_layers import (
    PackedNetwork,
    packed_layers,
    unsupported,
)
from drone_rl.policies import MLP, OriginalCNN, SmallCNN
from drone_rl.sim.rendering.devices import start_warp
from tests.own_networks import Mirrored, network_of

start_warp("cpu")


@wp.kernel(enable_backward=False)
def infer_kernel(
    layers: Layers, images: wp.array2d(dtype=float), workspace: wp.array(dtype=float), count: int
) -> None:
    for row in range(count):
        run_branches(layers, images[row], workspace, row)
    run_trunk(layers, workspace, 0, count)


def infer(packed, images, num_actions):
    first, last = packed.offsets.outputs[-2:]
    outputs = torch.full((len(images), last), torch.nan)
    given = wp.from_torch(images.flatten(1).contiguous())
    inputs = [packed.arrays, given, wp.from_torch(outputs.flatten()), len(images)]
    wp.launch(infer_kernel, 1, inputs=inputs, device="cpu")
    logits = outputs[:, first : first + WIDTH]
    assert not logits[:, num_actions:].any()
    return logits[:, :num_actions]


@pytest.mark.parametrize(
    ("shape", "options"),
    [
        ((1, 25, 64), {}),
        ((1, 25, 64), {"channels": (8,), "hidden": ()}),
        ((1, 26, 41), {"patch": 5, "channels": (3, 17, 40), "hidden": (33, 20)}),
        ((1, 4, 4), {"channels": (5,), "hidden": (7,)}),  # output of 1x1
        ((1, 12, 40), {"channels": (6, 9), "hidden": (16,)}),  # output with one row
    ],
)
def test_logits_equal_the_network_after_updates(shape, options):
    network = SmallCNN(shape, 3, generator=torch.Generator().manual_seed(0), **options)
    packed = PackedNetwork(network)
    optimizer = torch.optim.Adam(network.parameters(), lr=0.1)
    for count in (6, 1, 5):
        images = torch.randn(count, *shape)
        packed.pack()
        logits = network(images)
        given = infer(packed, images, 3)
        assert logits.abs().max() > 1e-3 and torch.allclose(given, logits, rtol=1e-4, atol=1e-5)
        logits.square().sum().backward()
        optimizer.step()
        assert not torch.allclose(given, network(images), rtol=1e-3)


@pytest.mark.parametrize(
    ("shape", "options"),
    [
        ((1, 25, 64), {}),
        ((1, 17, 19), {"channels": (3,), "hidden": (5,)}),  # pooling drops a row and a column
        ((1, 16, 16), {"channels": (18, 4), "hidden": ()}),  # output of 1x1
    ],
)
def test_logits_equal_those_of_a_network_with_pooling(shape, options):
    network = OriginalCNN(shape, 3, generator=torch.Generator().manual_seed(0), **options)
    packed = PackedNetwork(network)
    packed.pack()
    for count in (6, 1, 5):
        images = torch.randn(count, *shape)
        assert torch.allclose(infer(packed, images, 3), network(images), rtol=1e-4, atol=1e-4)


@pytest.mark.parametrize("channels", [1, 2])
def test_rows_of_larger_frames_are_skipped(channels):
    network = SmallCNN((channels, 12, 20), 3, generator=torch.Generator().manual_seed(0))
    packed = PackedNetwork(network, [(3 * 20, 5 * 20)])
    packed.pack()
    images = torch.randn(2, channels, 17, 20)
    assert torch.allclose(infer(packed, images, 3), network(images[:, :, 3:15]), atol=1e-5)


@pytest.mark.parametrize(
    ("layers", "is_supported"),
    [
        ([nn.Conv2d(1, 2, 3), nn.ReLU(), nn.Flatten(), nn.Linear(72, 3)], True),
        ([nn.Conv2d(1, 2, 3), nn.ReLU(), nn.MaxPool2d(4), nn.Flatten(), nn.Linear(2, 3)], True),
        ([nn.Conv2d(1, 2, 3), nn.Tanh(), nn.Flatten(), nn.Linear(72, 3)], False),
        ([nn.Conv2d(1, 2, 3), nn.Flatten(), nn.Linear(72, 3)], False),
        ([nn.Conv2d(1, 2, 3), nn.MaxPool2d(2), nn.Flatten(), nn.Linear(18, 3)], False),
        ([nn.MaxPool2d(2), nn.Conv2d(1, 2, 3), nn.ReLU(), nn.Flatten(), nn.Linear(8, 3)], False),
        ([nn.Flatten(), nn.Linear(64, 3)], False),
    ],
)
def test_only_supported_layers_are_packed(layers, is_supported):
    network = network_of(*layers)
    assert (not unsupported(network)) is is_supported
    if is_supported:
        packed = PackedNetwork(network)
        packed.pack()
        images = torch.randn(2, 1, 8, 8)
        assert torch.allclose(infer(packed, images, 3), network(images), atol=1e-5)


def test_other_networks_are_not_packed():
    assert unsupported(MLP((1, 25, 64), 3))
    assert unsupported(SmallCNN((1, 25, 64), 3).double())
    assert unsupported(Mirrored((1, 25, 64), 3)) == ["network Mirrored overrides forward"]


def small():
    network = SmallCNN((1, 8, 8), 3, patch=4, channels=(2,), hidden=(5,))
    return network, packed_layers(network)
