# pyright: reportArgumentType=false
# pyright: reportAttributeAccessIssue=false
# pyright: reportCallIssue=false
# pyright: reportIndexIssue=false
# pyright: reportOptionalMemberAccess=false
# (Layers of a network by name: torch annotates them to be anything.)
"""Policies whose true map is known, for their weights were made so: does the procedure find it?

Each looks at some windows of the picture alone and is set by hand, or trained with all the rest
hidden. Its true map is what its weights say: how strongly each pixel can reach the actions. Windows
are shares of the picture, so that they fit any camera.
"""

import copy
import dataclasses
from collections.abc import Sequence

import torch
from torch import Tensor, nn
from torch.nn import functional

from drone_rl.policies import MLP, PictureNetwork, PolicyNetwork, SmallCNN
from drone_rl.sim.actions import MOVES

Window = tuple[float, float, float, float]
"""Top, bottom, left and right, as shares of the picture."""
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
"""Pixels a side of a convolution's patches."""
STEPS = 120
"""Of gradient descent, where policies are trained."""


@dataclasses.dataclass(frozen=True)
class Planted:
    """A policy whose true map is `reach`."""

    name: str
    network: PolicyNetwork
    is_blind: bool = False
    """Whether no picture moves it, so that no map of it is true."""


def reach(network: PictureNetwork, observations: Tensor, actions: Tensor) -> Tensor:
    """How strongly each pixel can reach the choice of an action: a map made of weights alone.

    The sum over all paths from the pixel to the logits of the product of the weights' sizes; what
    raises all logits alike chooses nothing.

    Args:
        network: Any policy's.
        observations: Shape (T, C, h, w); their number alone matters.
        actions: Shape (T,).

    Returns:
        The same map T times. Shape: (T, h, w).
    """
    del actions
    sized = copy.deepcopy(network)
    layers = [layer for layer in sized.modules() if isinstance(layer, nn.Conv2d | nn.Linear)]
    with torch.no_grad():
        layers[-1].weight.sub_(layers[-1].weight.mean(0, keepdim=True))
        for layer in layers:
            layer.weight.abs_()
            layer.bias.zero_()
    x = torch.ones(1, *network.in_shape, requires_grad=True)
    (sizes,) = torch.autograd.grad(sized(x).sum(), x)
    return sizes.sum(1).expand(len(observations), -1, -1)


def plant(absent: Tensor, observations: Tensor, wanted: Tensor) -> list[Planted]:
    """All planted policies.

    Args:
        absent: The scene without cubes. Shape: (C, h, w).
        observations: Pictures to train on. Shape: (T, C, h, w).
        wanted: What an expert does there. Shape: (T,).
    """
    found = []
    for i, (name, window) in enumerate(WINDOWS.items()):
        sign = -1.0 if i % 2 else 1.0
        found += [
            Planted(f"{name}, linear, flat", linear(absent, [window], 0.5 * sign)),
            Planted(f"{name}, convolution, steep", convolution(absent, [window], -5.0 * sign)),
        ]
    names = list(WINDOWS)
    for first, second in ((0, 4), (1, 3), (5, 2), (6, 1)):
        windows = [WINDOWS[names[first]], WINDOWS[names[second]]]
        found.append(Planted(f"{names[first]} and {names[second]}", two_looks(absent, windows)))
    for name in ("left", "right", "small"):
        found.append(Planted(f"dark things, {name}", detector(absent, WINDOWS[name])))
    for seed, name in enumerate(("left", "right", "left edge", "ground, right")):
        network = trained(WINDOWS[name], observations, wanted, seed)
        found.append(Planted(f"{name}, trained", network))
    return found + blind(absent)


def linear(absent: Tensor, windows: Sequence[Window], scale: float) -> PolicyNetwork:
    """Goes left where windows are brighter than in the empty scene, right where darker."""
    network = MLP(tuple(absent.shape), len(MOVES), hidden=())
    look = _look(absent.shape, windows)
    _choose(network, scale * look.flatten(), -scale * float((look * absent).sum()))
    return network


def two_looks(absent: Tensor, windows: Sequence[Window], scale: float = 3.0) -> PolicyNetwork:
    """The same with a hidden layer, in which each window has two units: brighter, and darker."""
    network = MLP(tuple(absent.shape), len(MOVES), hidden=(2 * len(windows),))
    with torch.no_grad():
        for i, window in enumerate(windows):
            look = _look(absent.shape, [window])
            for unit, sign in ((2 * i, 1.0), (2 * i + 1, -1.0)):
                network.layers.fc1.weight[unit] = sign * look.flatten()
                network.layers.fc1.bias[unit] = -sign * float((look * absent).sum())
    _choose(network, scale * torch.tensor([1.0, -1.0] * len(windows)), 0.0)
    return network


def convolution(absent: Tensor, windows: Sequence[Window], scale: float) -> PolicyNetwork:
    """The same by a convolution: means of patches, of which it minds those in the windows."""
    network = SmallCNN(tuple(absent.shape), len(MOVES), channels=(2,), hidden=(), patch=PATCH)
    with torch.no_grad():
        mean = 1 / network.layers.conv1.weight[0].numel()
        network.layers.conv1.weight[0], network.layers.conv1.weight[1] = mean, -mean
        network.layers.conv1.bias.zero_()
    minds = _minded(absent, windows)
    weights = scale * torch.stack([minds, -minds]).flatten()
    means = functional.avg_pool2d(absent.mean(0)[None], PATCH)[0]
    _choose(network, weights, -scale * float((means * minds).sum()))
    return network


def detector(absent: Tensor, window: Window, scale: float = 6.0) -> PolicyNetwork:
    """Goes left where a patch of a window is much darker than anything in the empty scene."""
    network = SmallCNN(tuple(absent.shape), len(MOVES), channels=(1,), hidden=(), patch=PATCH)
    with torch.no_grad():
        network.layers.conv1.weight.fill_(-1 / network.layers.conv1.weight[0].numel())
        network.layers.conv1.bias.fill_(float(absent.min()) - 0.2)
    _choose(network, scale * _minded(absent, [window]).flatten(), 0.0)
    return network


def trained(window: Window, observations: Tensor, wanted: Tensor, seed: int = 0) -> PolicyNetwork:
    """Learns from an expert with all but one window hidden.

    Args:
        window: What it sees.
        observations: Shape (T, C, h, w).
        wanted: The expert's actions. Shape: (T,).
        seed: Of the first weights.
    """
    generator = torch.Generator().manual_seed(seed)
    shape = tuple(observations.shape[1:])
    network = MLP(shape, len(MOVES), hidden=(16,), generator=generator)
    seen = (_look(shape, [window]) > 0).flatten()
    weight = network.layers.fc1.weight
    optimiser = torch.optim.Adam(network.parameters(), lr=0.01)
    for _ in range(STEPS):
        with torch.no_grad():
            weight[:, ~seen] = 0.0
        optimiser.zero_grad()
        functional.cross_entropy(network(observations), wanted).backward()
        optimiser.step()
    with torch.no_grad():
        weight[:, ~seen] = 0.0
    return network


def blind(absent: Tensor) -> list[Planted]:
    """Policies that no picture moves."""
    constant = linear(absent, [WINDOWS["left"]], 0.0)
    sure = linear(absent, [WINDOWS["left"]], 0.01)
    dead = convolution(absent, [WINDOWS["left"]], 5.0)
    with torch.no_grad():
        constant.layers.logits.bias.copy_(torch.tensor([0.3, 0.1, -0.2]))
        sure.layers.logits.bias.copy_(torch.tensor([60.0, 0.0, 0.0]))
        dead.layers.conv1.bias.fill_(-1000.0)
    networks = {"constant": constant, "too sure": sure, "dead units": dead}
    return [Planted(f"blind: {name}", network, True) for name, network in networks.items()]


def _choose(network: PolicyNetwork, weights: Tensor, bias: float) -> None:
    """Left by so much, right by as much less, forward in between."""
    with torch.no_grad():
        logits = network.layers.logits
        logits.weight.zero_()
        logits.bias.zero_()
        logits.weight[MOVES.left], logits.weight[MOVES.right] = weights, -weights
        logits.bias[MOVES.left], logits.bias[MOVES.right] = bias, -bias


def _look(shape: Sequence[int], windows: Sequence[Window]) -> Tensor:
    """Weights that take the mean over windows. Shape: (C, h, w)."""
    look = torch.zeros(*shape)
    for window in windows:
        rows, columns = _span(window, shape[-2], shape[-1])
        look[..., rows, columns] = 1.0
    return look / look.sum()


def _minded(absent: Tensor, windows: Sequence[Window]) -> Tensor:
    """The same of patches. Shape: (patches down, patches across)."""
    down, across = absent.shape[-2] // PATCH, absent.shape[-1] // PATCH
    return _look((down, across), windows)


def _span(window: Window, height: int, width: int) -> tuple[slice, slice]:
    top, bottom, left, right = window
    rows = slice(round(top * height), max(round(top * height) + 1, round(bottom * height)))
    columns = slice(round(left * width), max(round(left * width) + 1, round(right * width)))
    return rows, columns
