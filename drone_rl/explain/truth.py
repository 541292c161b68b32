"""Is the picture true? Heat maps against what the simulator knows (pure functions of maps)."""

import copy
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.stats import rankdata
from torch import Tensor, nn

from drone_rl.explain.attribution import Explainer, MapMethod
from drone_rl.explain.hooks import probabilities
from drone_rl.explain.intervals import mean_interval
from drone_rl.explain.scenes import Region
from drone_rl.policies import PolicyNetwork

CURVE_STEPS = 10
"""Parts in which a picture is deleted or inserted."""
SANITY_FRAMES = 100
"""Frames whose maps are compared with those of randomised weights."""


def pointing_game(maps: NDArray, regions: NDArray, episode: NDArray) -> dict[str, Any]:
    """Is the brightest pixel on the next cube? (Zhang et al., 2018).

    Frames on which the next cube is not to be seen don't count; a map without any heat misses.

    Args:
        maps: Shape (T, H, W), 0 or more.
        regions: `Region` of each pixel. Shape: (T, H, W).
        episode: Shape (T,).

    Returns:
        "hit", and beside it "chance": the share of the picture that the cube fills.
    """
    flat, target = _flat(maps), _flat(regions) == Region.NEXT_CUBE
    seen = target.any(1)
    brightest = flat.argmax(1)
    hit = target[np.arange(len(flat)), brightest] & (flat.max(1) > 0)
    return {
        "hit": mean_interval(np.where(seen, hit, np.nan), episode),
        "chance": mean_interval(np.where(seen, target.mean(1), np.nan), episode),
        "maps_without_heat": int((flat.max(1) <= 0).sum()),
    }


def heat_shares(maps: NDArray, regions: NDArray, episode: NDArray) -> dict[str, Any]:
    """How a map's heat is shared out to cubes, horizon, ground and sky.

    Returns:
        By region name, "share" of the heat and "chance": the region's share of the picture.
    """
    flat, areas = _flat(maps), _flat(regions)
    total = flat.sum(1)
    share = np.divide(
        flat, total[:, None], out=np.full_like(flat, np.nan), where=total[:, None] > 0
    )
    return {
        region.name.lower(): {
            "share": mean_interval((share * (areas == region)).sum(1), episode),
            "chance": mean_interval((areas == region).mean(1), episode),
        }
        for region in Region
    }


def deletion_insertion(
    network: PolicyNetwork,
    observations: Tensor,
    actions: Tensor,
    maps: Tensor,
    absent: Tensor,
    episode: NDArray,
) -> dict[str, Any]:
    """The probability of the chosen action while the hottest pixels are taken away, or put back.

    A taken pixel is replaced by the scene without cubes (Petsiuk et al., 2018).

    Args:
        network: The policy's.
        observations: Shape (T, C, H, W).
        actions: Shape (T,).
        maps: Shape (T, H, W).
        absent: The scene without cubes. Shape: (C, H, W).
        episode: Shape (T,).

    Returns:
        For "deletion" (lower is better) and "insertion" (higher is better) the mean "curve" and
        the "area" under it with its interval.
    """
    order = maps.flatten(1).argsort(dim=1, descending=True, stable=True)
    rank = torch.empty_like(order).scatter_(1, order, torch.arange(order.shape[1]).expand_as(order))
    rank = rank.view(len(maps), 1, *maps.shape[1:])
    curves: dict[str, list[Tensor]] = {"deletion": [], "insertion": []}
    for step in range(CURVE_STEPS + 1):
        hottest = rank < round(order.shape[1] * step / CURVE_STEPS)
        for name, taken in (("deletion", hottest), ("insertion", ~hottest)):
            changed = torch.where(taken, absent, observations)
            chosen = probabilities(network, changed).gather(1, actions[:, None])[:, 0]
            curves[name].append(chosen)
    results = {}
    for name, points in curves.items():
        curve = torch.stack(points, 1).double().numpy()
        area = np.trapezoid(curve, dx=1 / CURVE_STEPS, axis=1)
        results[name] = {"curve": curve.mean(0).tolist(), "area": mean_interval(area, episode)}
    return results


def randomisation_test(
    explainer: Explainer, name: str, observations: Tensor, actions: Tensor, seed: int = 0
) -> dict[str, Any]:
    """Do the maps change when weights are randomised? (Adebayo et al., 2018).

    Layers are randomised from the last to the first, each on top of those before; a map that says
    something of the policy must lose its likeness to what it was.

    Args:
        explainer: Of the trained policy, which is left as it is.
        name: Of the method.
        observations: Shape (T, C, H, W); `SANITY_FRAMES` of them are used.
        actions: Shape (T,).
        seed: Of the random weights.

    Returns:
        "layers", cumulative; "correlation": the mean rank correlation of old and new maps after
        each; "passed": whether the last is below one half.
    """
    rows = torch.linspace(0, len(actions) - 1, min(len(actions), SANITY_FRAMES)).long()
    x, a = observations[rows], actions[rows]
    before = explainer.methods()[name](x, a).flatten(1).numpy()
    network = copy.deepcopy(explainer.network)
    method: MapMethod = Explainer(network, explainer.absent, explainer.layer).methods()[name]
    generator = torch.Generator().manual_seed(seed)
    layers, correlations = [], []
    for layer_name, layer in reversed(list(network.layers.named_children())):
        if not isinstance(layer, nn.Conv2d | nn.Linear):
            continue
        _randomise(layer, generator)
        after = method(x, a).flatten(1).numpy()
        layers.append(layer_name)
        correlations.append(float(np.mean(rank_correlation(before, after))))
    return {"layers": layers, "correlation": correlations, "passed": correlations[-1] < 0.5}


def rank_correlation(first: NDArray, second: NDArray) -> NDArray:
    """Spearman's correlation of each row of two arrays; 0 where one is constant. Shape: (T,)."""
    a, b = rankdata(first, axis=1), rankdata(second, axis=1)
    a, b = a - a.mean(1, keepdims=True), b - b.mean(1, keepdims=True)
    norm = np.sqrt((a**2).sum(1) * (b**2).sum(1))
    return np.divide((a * b).sum(1), norm, out=np.zeros(len(a)), where=norm > 0)


def _randomise(layer: nn.Conv2d | nn.Linear, generator: torch.Generator) -> None:
    """Weights of the same size as before, but random."""
    with torch.no_grad():
        for parameter in (layer.weight, layer.bias):
            scale = float(parameter.std(correction=0)) if parameter.numel() > 1 else 1.0
            parameter.normal_(0.0, max(scale, 1e-6), generator=generator)


def _flat(pictures: NDArray) -> NDArray:
    flat = pictures.reshape(len(pictures), -1)
    return flat.astype(np.float64) if np.issubdtype(flat.dtype, np.floating) else flat
