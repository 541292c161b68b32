"""Bounds on images and logits: by hand, and compared with every image in the range."""

import itertools
from collections import OrderedDict

import numpy as np
import pytest
import torch
from torch import nn

from drone_rl.policies import OriginalCNN, PolicyNetwork, SmallCNN
from drone_rl.utils.errors import InputError
from drone_rl.verification.prover.bounds import (
    Compositor,
    ImageRanges,
    NetworkBounds,
    masks_of,
)
from drone_rl.verification.prover.cube_images import FRONT, LEFT_SIDE, NOTHING, RIGHT_SIDE
from tests.own_networks import Mirrored


def images(*pixels):
    return torch.tensor(pixels)[:, None, None].float()


def test_common_terms_cancel():
    """Both logits rise alike with the first pixel, so that it decides nothing."""
    bounds = NetworkBounds(last_layer([[5.0, 1.0], [5.0, 0.0]], [0.0, 0.0]), gap=0.1)
    assert bounds.possible(images([-9, 0.2]), images([9, 1])).tolist() == [0b01]
    assert bounds.possible(images([-9, -1]), images([9, -0.2])).tolist() == [0b10]
    assert bounds.possible(images([-9, 0.05]), images([9, 1])).tolist() == [0b11]


def test_decide_and_gap():
    bounds = NetworkBounds(last_layer([[1.0, 0.0], [0.0, 1.0]], [0.0, 0.0]), gap=0.5)
    bits, gaps = bounds.decide(images([3, 1], [1, 1.2], [0, 2]))
    assert bits.tolist() == [0b01, 0b11, 0b10]
    assert gaps.tolist() == pytest.approx([2.0, 0.2, 2.0])


def test_a_third_action_is_excluded():
    bounds = NetworkBounds(
        last_layer([[1.0, 0.0], [0.0, 1.0], [0.0, 0.0]], [0.0, 0.0, -5.0]), gap=0.0
    )
    assert bounds.possible(images([0.0, 0.0]), images([1.0, 1.0])).tolist() == [0b011]


@pytest.mark.parametrize(("make", "doubt"), [(SmallCNN, 0.05), (OriginalCNN, 1e-3)])
def test_bounds_hold_for_all_images_in_range(make, doubt):
    """Two pixels in doubt and all mixtures of them: no action is taken that bounds excluded."""
    generator = torch.Generator().manual_seed(0)
    network = make((1, 25, 64), 3, generator=generator).eval()
    with torch.no_grad():
        network.layers[-1].weight.mul_(100)
        network.layers[-1].bias.copy_(torch.tensor([-1000.0, 0.0, 1000.0]))  # beyond rounding
    bounds = NetworkBounds(network, gap=1e-4)
    lower = torch.rand(12, 1, 25, 64, generator=generator)
    upper = lower.clone()
    upper[:, 0, 10, 30] += doubt
    upper[:, 0, 12, 31] += doubt
    possible = bounds.possible(lower.clone(), upper.clone())
    single = possible & (possible - 1) == 0
    assert single.any()  # else it says nothing
    for rows in itertools.product((False, True), repeat=2):
        mixed = lower.clone()
        mixed[:, 0, 10, 30] += doubt * rows[0]
        mixed[:, 0, 12, 31] += doubt * rows[1]
        bits, _ = bounds.decide(mixed)
        assert ((bits & ~possible) == 0).all()


def test_actions_decided_by_summation_order_stay_possible():
    """The hidden unit is 2^24 + 1 - 2^24: 1 in exact arithmetic, 0 in some orders."""
    hidden = nn.Linear(2, 2)
    with torch.no_grad():
        hidden.weight.copy_(torch.tensor([[2.0**24, -(2.0**24)], [0.0, 0.0]]))
        hidden.bias.copy_(torch.tensor([1.0, 0.0]))
    network = last_layer([[1.0, 0.0], [0.0, 0.0]], [0.0, 0.5], nn.Flatten(), hidden, nn.ReLU())
    bounds = NetworkBounds(network, gap=0.0)
    seen = images([1.0, 1.0])
    assert bounds.decide(seen)[0].tolist() == [0b11]
    assert bounds.possible(seen.clone(), seen.clone()).tolist() == [0b11]
    plain = last_layer([[1.0, 0.0], [0.0, 0.0]], [0.0, 0.5])
    assert NetworkBounds(plain, gap=0.0).decide(seen)[0].tolist() == [0b01]


COMPOSITOR = Compositor(torch.tensor([[0.5, 0.9]]), torch.tensor([0.3, 0.1, 0.7]), nn.Identity())


ALL = (slice(0, 1), slice(0, 2))


def mask(*pixels):
    """One case; what each pixel may show."""
    bits = [sum(1 << face for face in faces) for faces in pixels]
    return torch.tensor([[bits]], dtype=torch.uint8)


def paint(*cubes):
    case = torch.tensor([0])
    lower, upper = COMPOSITOR.paint([(ALL, cube, case) for cube in cubes], len(case))
    return lower[0, 0].tolist(), upper[0, 0].tolist()


def close(found, lower, upper):
    assert torch.allclose(torch.tensor(found[0]), torch.tensor(lower))
    assert torch.allclose(torch.tensor(found[1]), torch.tensor(upper))


def test_bounds_equal_extremes_of_all_images():
    """Every mixture of what two cubes may show, painted one by one."""
    choices = [[NOTHING], [FRONT], [NOTHING, LEFT_SIDE], [FRONT, RIGHT_SIDE], [0, 1, 2, 3]]
    for near, far in itertools.product(choices, repeat=2):
        seen = []
        for one, other in itertools.product(near, far):
            faces = [torch.tensor([[[f, f]]], dtype=torch.uint8) for f in (one, other)]
            seen.append(torch.tensor(paint(*map(masks_of, faces))[0]))
        lower, upper = paint(mask(near, near), mask(far, far))
        close(
            (lower, upper),
            torch.stack(seen).min(0).values.tolist(),
            torch.stack(seen).max(0).values.tolist(),
        )


def test_masks_of_every_range():
    images = torch.from_numpy(np.random.RandomState(0).randint(0, 4, (9, 2, 3)).astype(np.uint8))
    ranges = ImageRanges(images)
    every = np.array([(a, b) for a in range(9) for b in range(a, 9)])
    masks, case = ranges.of(every)
    for (a, b), mask, doubts in zip(every, masks[case], ranges.doubts(every), strict=True):
        shown = [{*pixel} for pixel in images[a : b + 1].flatten(1).T.tolist()]
        assert mask.flatten().tolist() == [sum(1 << face for face in faces) for faces in shown]
        assert doubts == sum(len(faces) > 1 for faces in shown)


def last_layer(weight, bias, *before):
    """Return a network of two pixels that ends in this linear layer."""
    last = nn.Linear(2, len(weight))
    with torch.no_grad():
        last.weight.copy_(torch.tensor(weight))
        last.bias.copy_(torch.tensor(bias))
    layers = {str(i): layer for i, layer in enumerate([*before, nn.Flatten()])}
    return PolicyNetwork((1, 1, 2), OrderedDict(layers, logits=last), lambda *_: None)


@pytest.mark.parametrize(
    "network",
    [Mirrored((1, 25, 64), 3), last_layer([[1.0, 0.0]], [0.0], nn.Tanh())],
    ids=["own forward", "tanh"],
)
def test_unsupported_networks_are_refused(network):
    with pytest.raises(InputError, match="proofs do not support it: network "):
        NetworkBounds(network, gap=0.0)
