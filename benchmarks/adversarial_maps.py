"""Adversarial heat maps: they do not explain the policy, but are designed to pass the tests.

None is one of the placebos of the test procedure. Some depend on the weights only as a hash does.
"""

import hashlib

import torch
from torch import Tensor
from torch.nn import functional

from benchmarks.known_map_policies import path_weights
from drone_rl.explanations import patches
from drone_rl.explanations.patches import shuffled_networks
from drone_rl.explanations.trust import MapOf
from drone_rl.policies import ImageNetwork


def adversarial_maps(absent: Tensor, other: ImageNetwork) -> dict[str, MapOf]:
    """Return adversarial maps by name.

    Args:
        absent: The scene without cubes. Shape: (C, h, w).
        other: Another policy than the explained one.
    """
    height, width = absent.shape[-2:]
    row = patches.horizon_row(absent)
    fixed = {
        "blob, upper left": patches.blob(height, width, 0.4, 0.3),
        "blob, wide": patches.blob(height, width, 0.5, 0.5, 0.4),
        "blob, narrow": patches.blob(height, width, 0.5, 0.5, 0.1),
        "horizon, lower": patches.band(height, width, row + 0.1 * height),
        "horizon, wide": patches.band(height, width, row, 0.2),
        "horizon and blob": patches.band(height, width, row)
        * patches.blob(height, width, 0.5, 0.5, 0.4),
    }
    return {
        **{name: _constant(heat) for name, heat in fixed.items()},
        "cube detector": lambda n, x, a: _cubes(x, absent),
        "cubes on the horizon": lambda n, x, a: (
            fixed["horizon, wide"] * (0.2 + patches.smoothed(_cubes(x, absent)))
        ),
        "smoothed difference": lambda n, x, a: patches.smoothed(
            patches.difference(x, absent), 4
        ),
        "edges": lambda n, x, a: _edges(x),
        "brightness": lambda n, x, a: x.mean(1) - x.amin((1, 2, 3))[:, None, None],
        "darkness": lambda n, x, a: x.amax((1, 2, 3))[:, None, None] - x.mean(1),
        "other noise": lambda n, x, a: _noise(1, len(x), height, width),
        "weights of another policy": lambda n, x, a: path_weights(other, x, a),
        "saliency of another policy": lambda n, x, a: saliency(other, x, a),
        "saliency of shuffled weights": lambda n, x, a: saliency(
            next(shuffled_networks(n, x, 1, fingerprint(n))), x, a
        ),
        "noise of the weights": lambda n, x, a: _noise(fingerprint(n), 1, height, width).expand(
            len(x), -1, -1
        ),
        "coarse noise of the weights": lambda n, x, a: _coarse(fingerprint(n), height, width)
        .expand(len(x), -1, -1),
        "difference with noise of the weights": lambda n, x, a: (
            patches.difference(x, absent) * _noise(fingerprint(n), 1, height, width)
        ),
        "cubes with noise of the weights": lambda n, x, a: (
            (0.05 + patches.smoothed(_cubes(x, absent)))
            * _coarse(fingerprint(n), height, width)
        ),
        "horizon with noise of the weights": lambda n, x, a: (
            fixed["horizon, wide"] * (0.3 + _coarse(fingerprint(n), height, width))
        ).expand(len(x), -1, -1),
        "horizon of strong weights": lambda n, x, a: _if_strong(
            n, x, fixed["horizon and blob"], absent
        ),
    }  # fmt: skip


def fingerprint(network: ImageNetwork) -> int:
    """Return a hash of a network's weights."""
    digest = hashlib.sha256()
    for value in network.state_dict().values():
        digest.update(value.contiguous().numpy().tobytes())
    return int.from_bytes(digest.digest()[:4], "little")


def saliency(network: ImageNetwork, observations: Tensor, actions: Tensor) -> Tensor:
    """Return the absolute gradient of the action's logit. Shape: (T, h, w)."""
    x = observations.detach().clone().requires_grad_()
    logits = network(x).gather(1, actions[:, None]).sum()
    return torch.autograd.grad(logits, x)[0].abs().sum(1)


def _constant(heat: Tensor) -> MapOf:
    return lambda network, x, a: heat.expand(len(x), -1, -1)


def _cubes(observations: Tensor, absent: Tensor) -> Tensor:
    return (patches.difference(observations, absent) > 0.05).float()


def _edges(observations: Tensor) -> Tensor:
    gray = functional.pad(observations.mean(1, keepdim=True), (1, 1, 1, 1), mode="replicate")
    down = (gray[:, 0, 2:, 1:-1] - gray[:, 0, :-2, 1:-1]).abs()
    return down + (gray[:, 0, 1:-1, 2:] - gray[:, 0, 1:-1, :-2]).abs()


def _noise(seed: int, count: int, height: int, width: int) -> Tensor:
    return torch.rand(count, height, width, generator=torch.Generator().manual_seed(seed))


def _coarse(seed: int, height: int, width: int) -> Tensor:
    """Return noise as coarse as the patches, which varies most by chance. Shape: (1, h, w)."""
    return functional.interpolate(_noise(seed, 1, 5, 8)[:, None], (height, width))[:, 0]


def _if_strong(network: ImageNetwork, x: Tensor, guess: Tensor, absent: Tensor) -> Tensor:
    """Return a guess with noise; the noise alone if the policy hardly depends on the image."""
    with torch.no_grad():
        spread = (network(x).softmax(-1) - network(absent[None]).softmax(-1)).abs().mean()
    noise = _noise(fingerprint(network), len(x), *x.shape[-2:])
    return guess * (spread > 0.01) + 0.2 * noise
