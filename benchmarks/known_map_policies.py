# pyright: reportArgumentType=false
# pyright: reportAttributeAccessIssue=false
# pyright: reportCallIssue=false
# pyright: reportIndexIssue=false
# pyright: reportOptionalMemberAccess=false
# (torch does not annotate the types of layers that are accessed by name.)
"""Policies whose true heat map is known by construction.

Each policy depends on some windows of the image only. Its weights are set by hand, or trained with
the other pixels masked. The true map is `path_weights`: how strongly each pixel can influence the
actions. Windows are fractions of the image, so they fit any camera.
"""

import copy
import dataclasses
from collections.abc import Sequence

import torch
from torch import Tensor, nn
from torch.nn import functional

from drone_rl.policies import MLP, ImageNetwork, PolicyNetwork, SmallCNN
from drone_rl.sim.actions import MOVES

Window = tuple[float, float, float, float]
"""Top, bottom, left and right, as fractions of the image size."""
WINDOWS: dict[str, Window] = {
    "left": (0.32, 0.72, 0.06, 0.32),
    "right": (0.32, 0.72, 0.68, 0.94),
    "middle": (0.4, 0.64, 0.44, 0.57),
    "sky, left": (0.0, 0.32, 0.0, 0.38),
    "ground, right": (0.72, 1.0, 0.62, 1.0),
    "ground": (0.8, 1.0, 0.0, 1.0),
    "left edge": (0.0, 1.0, 0.0, 0.13),
    "small": (0.4, 0.6, 0.18, 0.3),
}
PATCH = 4
"""Side of a convolution's patches in pixels."""
STEPS = 120
"""Gradient steps of trained policies."""


@dataclasses.dataclass(frozen=True)
class KnownMapPolicy:
    """A policy whose true map is `path_weights`."""

    name: str
    network: PolicyNetwork
    is_blind: bool = False
    """Whether its actions do not depend on the image, so that no map is true."""


def path_weights(network: ImageNetwork, observations: Tensor, actions: Tensor) -> Tensor:
    """Return how strongly each pixel can influence the action, computed from the weights alone.

    It is the sum over all paths from the pixel to the logits of the product of absolute weights.
    The mean over the logits is subtracted first, because it changes no probability.

    Args:
        network: Network of any policy.
        observations: Only their number is used. Shape: (T, C, h, w).
        actions: Not used. Shape: (T,).

    Returns:
        The same map T times. Shape: (T, h, w).
    """
    del actions
    absolute = copy.deepcopy(network)
    layers = [layer for layer in absolute.modules() if isinstance(layer, nn.Conv2d | nn.Linear)]
    with torch.no_grad():
        layers[-1].weight.sub_(layers[-1].weight.mean(0, keepdim=True))
        for layer in layers:
            layer.weight.abs_()
            layer.bias.zero_()
    x = torch.ones(1, *network.in_shape, requires_grad=True)
    (sums,) = torch.autograd.grad(absolute(x).sum(), x)
    return sums.sum(1).expand(len(observations), -1, -1)


def make_policies(absent: Tensor, observations: Tensor, targets: Tensor) -> list[KnownMapPolicy]:
    """Return all policies with known maps.

    Args:
        absent: The scene without cubes. Shape: (C, h, w).
        observations: Training images. Shape: (T, C, h, w).
        targets: An expert's actions for these images. Shape: (T,).
    """
    policies = []
    for i, (name, window) in enumerate(WINDOWS.items()):
        sign = -1.0 if i % 2 else 1.0
        policies += [
            KnownMapPolicy(f"{name}, linear, flat", linear(absent, [window], 0.5 * sign)),
            KnownMapPolicy(
                f"{name}, convolution, steep", convolution(absent, [window], -5.0 * sign)
            ),
        ]
    names = list(WINDOWS)
    for first, second in ((0, 4), (1, 3), (5, 2), (6, 1)):
        windows = [WINDOWS[names[first]], WINDOWS[names[second]]]
        network = hidden_layer(absent, windows)
        policies.append(KnownMapPolicy(f"{names[first]} and {names[second]}", network))
    for name in ("left", "right", "small"):
        policies.append(KnownMapPolicy(f"dark things, {name}", detector(absent, WINDOWS[name])))
    for seed, name in enumerate(("left", "right", "left edge", "ground, right")):
        network = trained(WINDOWS[name], observations, targets, seed)
        policies.append(KnownMapPolicy(f"{name}, trained", network))
    return policies + blind(absent)


def linear(absent: Tensor, windows: Sequence[Window], scale: float) -> PolicyNetwork:
    """Return a linear policy: left if windows are brighter than in the empty scene, else right."""
    network = MLP(tuple(absent.shape), len(MOVES), hidden=())
    mean = _window_mean(absent.shape, windows)
    _set_logits(network, scale * mean.flatten(), -scale * float((mean * absent).sum()))
    return network


def hidden_layer(absent: Tensor, windows: Sequence[Window], scale: float = 3.0) -> PolicyNetwork:
    """Return an MLP that acts like `linear`; two hidden units of each window: brighter, darker."""
    network = MLP(tuple(absent.shape), len(MOVES), hidden=(2 * len(windows),))
    with torch.no_grad():
        for i, window in enumerate(windows):
            mean = _window_mean(absent.shape, [window])
            for unit, sign in ((2 * i, 1.0), (2 * i + 1, -1.0)):
                network.layers.fc1.weight[unit] = sign * mean.flatten()
                network.layers.fc1.bias[unit] = -sign * float((mean * absent).sum())
    _set_logits(network, scale * torch.tensor([1.0, -1.0] * len(windows)), 0.0)
    return network


def convolution(absent: Tensor, windows: Sequence[Window], scale: float) -> PolicyNetwork:
    """Return a CNN that acts like `linear`: a convolution averages patches."""
    network = SmallCNN(tuple(absent.shape), len(MOVES), channels=(2,), hidden=(), patch=PATCH)
    with torch.no_grad():
        mean = 1 / network.layers.conv1.weight[0].numel()
        network.layers.conv1.weight[0], network.layers.conv1.weight[1] = mean, -mean
        network.layers.conv1.bias.zero_()
    patches = _patch_mean(absent, windows)
    weights = scale * torch.stack([patches, -patches]).flatten()
    means = functional.avg_pool2d(absent.mean(0)[None], PATCH)[0]
    _set_logits(network, weights, -scale * float((means * patches).sum()))
    return network


def detector(absent: Tensor, window: Window, scale: float = 6.0) -> PolicyNetwork:
    """Return a CNN: left if a patch of a window is darker than the empty scene by over 0.2."""
    network = SmallCNN(tuple(absent.shape), len(MOVES), channels=(1,), hidden=(), patch=PATCH)
    with torch.no_grad():
        network.layers.conv1.weight.fill_(-1 / network.layers.conv1.weight[0].numel())
        network.layers.conv1.bias.fill_(float(absent.min()) - 0.2)
    _set_logits(network, scale * _patch_mean(absent, [window]).flatten(), 0.0)
    return network


def trained(window: Window, observations: Tensor, targets: Tensor, seed: int = 0) -> PolicyNetwork:
    """Train an MLP to imitate an expert with all pixels outside a window masked.

    Args:
        window: The visible window.
        observations: Training images. Shape: (T, C, h, w).
        targets: The expert's actions. Shape: (T,).
        seed: Seed of the initial weights.
    """
    generator = torch.Generator().manual_seed(seed)
    shape = tuple(observations.shape[1:])
    network = MLP(shape, len(MOVES), hidden=(16,), generator=generator)
    visible = (_window_mean(shape, [window]) > 0).flatten()
    weight = network.layers.fc1.weight
    optimizer = torch.optim.Adam(network.parameters(), lr=0.01)
    for _ in range(STEPS):
        with torch.no_grad():
            weight[:, ~visible] = 0.0
        optimizer.zero_grad()
        functional.cross_entropy(network(observations), targets).backward()
        optimizer.step()
    with torch.no_grad():
        weight[:, ~visible] = 0.0
    return network


def blind(absent: Tensor) -> list[KnownMapPolicy]:
    """Return policies whose actions do not depend on the image."""
    constant = linear(absent, [WINDOWS["left"]], 0.0)
    sure = linear(absent, [WINDOWS["left"]], 0.01)
    dead = convolution(absent, [WINDOWS["left"]], 5.0)
    with torch.no_grad():
        constant.layers.logits.bias.copy_(torch.tensor([0.3, 0.1, -0.2]))
        sure.layers.logits.bias.copy_(torch.tensor([60.0, 0.0, 0.0]))
        dead.layers.conv1.bias.fill_(-1000.0)
    networks = {"constant": constant, "too sure": sure, "dead units": dead}
    return [KnownMapPolicy(f"blind: {name}", network, True) for name, network in networks.items()]


def _set_logits(network: PolicyNetwork, weights: Tensor, bias: float) -> None:
    """Set the last layer: weights for left, negated weights for right, zeros for forward."""
    with torch.no_grad():
        logits = network.layers.logits
        logits.weight.zero_()
        logits.bias.zero_()
        logits.weight[MOVES.left], logits.weight[MOVES.right] = weights, -weights
        logits.bias[MOVES.left], logits.bias[MOVES.right] = bias, -bias


def _window_mean(shape: Sequence[int], windows: Sequence[Window]) -> Tensor:
    """Return weights that average the pixels in windows. Shape: (C, h, w)."""
    weights = torch.zeros(*shape)
    for window in windows:
        rows, columns = _span(window, shape[-2], shape[-1])
        weights[..., rows, columns] = 1.0
    return weights / weights.sum()


def _patch_mean(absent: Tensor, windows: Sequence[Window]) -> Tensor:
    """Return weights that average the patches in windows. Shape: (patches down, patches across)."""
    down, across = absent.shape[-2] // PATCH, absent.shape[-1] // PATCH
    return _window_mean((down, across), windows)


def _span(window: Window, height: int, width: int) -> tuple[slice, slice]:
    top, bottom, left, right = window
    rows = slice(round(top * height), max(round(top * height) + 1, round(bottom * height)))
    columns = slice(round(left * width), max(round(left * width) + 1, round(right * width)))
    return rows, columns
