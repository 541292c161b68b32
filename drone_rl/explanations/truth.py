"""Section "truth": tests of the heat maps against the effects of changes to the scene.

Besides the tests in `trust`: pixel-level deletion and insertion curves (Petsiuk et al., 2018), the
heat by region and the pointing game (Zhang et al., 2018), and the interventions.
"""

from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from drone_rl.explanations import interventions, trust
from drone_rl.explanations.context import Context
from drone_rl.explanations.hooks import actions_of, probabilities
from drone_rl.explanations.scenes import Region
from drone_rl.explanations.trust import Trial
from drone_rl.policies import PictureNetwork
from drone_rl.utils.intervals import episode_means, mean_bounds, mean_interval

SHARES = (0.0, 0.01, 0.02, 0.03, 0.05, 0.075, 0.1, 0.15, 0.2, 0.3, 0.4, 0.6, 0.8, 1.0)
"""Fractions of the pixels that are replaced. A far cube covers a hundredth of the frame."""


def section(context: Context) -> tuple[dict[str, Any], dict[str, NDArray]]:
    """Return "truth".

    It has the results of `check_maps`, of no method if the weights are unknown; "heat" of each
    method by region; "cube": the pointing game; "curves" of deletion and insertion of methods and
    placebos; "interventions": effects of changes to the scene; "outcomes" of rollouts (None if no
    frame has a next target); "integration_error" of integrated gradients; "empty": why maps of
    Grad-CAM are zero.

    Arrays: "interventions" (K, H, W, 3): one frame after each change; "patch_effects" (rows,
    columns): mean effect of each patch.
    """
    data, network, seed = context.dataset, context.network, context.seed.value
    worlds = context.scenes.worlds
    state = data.state(worlds.task, worlds.dynamics).to(context.device)
    episode = context.episode
    trial = trust.make_trial(context.scenes, network, state, context.actions, episode, seed)
    changes = interventions.intervene(
        context.scenes, network, state, data.tensor("regions"), seed=seed
    )
    shown = int(np.argmax(np.nan_to_num(changes[0].effect)))
    outcomes = interventions.outcomes(context.scenes, network, state, episode)
    frame_maps = {name: maps.numpy() for name, maps in context.frame_maps.items()}
    numbers = {
        **_tests(context, trial),
        "heat": {n: heat_shares(m, data.regions, episode) for n, m in frame_maps.items()},
        "cube": {n: pointing_game(m, data.regions, episode) for n, m in frame_maps.items()},
        "interventions": {c.name: mean_interval(c.effect, episode) for c in changes},
        "outcomes": outcomes if outcomes["flights"] else None,
        "integration_error": _integration_error(context, trial),
        "empty": _empty(context),
        "shown_frame": shown,
    }
    effects = trial.effects if len(trial.effects) else np.zeros((1, trial.grid.count))
    arrays = {
        "interventions": np.stack([c.frames[shown].cpu().numpy() for c in changes]),
        "patch_effects": effects.mean(0).reshape(trial.grid.rows, trial.grid.columns),
    }
    return {"truth": numbers}, arrays


def _tests(context: Context, trial: Trial) -> dict[str, Any]:
    """Return the tests of all methods, and the curves of methods and placebos."""
    methods = trust.method_maps(context.explainer) if context.network.has_weights else {}
    maps = {name: trial.maps(method) for name, method in methods.items()}
    every = {**maps, **trial.placebos}
    inputs = trial.network, trial.observations, trial.actions

    def curve(heat: Tensor) -> dict[str, Any]:
        return deletion_insertion(*inputs, heat, context.absent, trial.episode)

    with ThreadPoolExecutor(2) as pool:
        curves = dict(zip(every, pool.map(curve, every.values()), strict=True))
    return {**trust.check_maps(trial, methods, maps), "curves": {"shares": SHARES, **curves}}


def _integration_error(context: Context, trial: Trial) -> dict[str, float] | None:
    """Return mean and largest error of the integral, on one frame of each episode."""
    few = trial.thinned()
    if not len(few.actions) or not context.network.is_differentiable:
        return None
    error = context.explainer.completeness_error(few.observations, few.actions)
    return {"mean": float(error.mean()), "max": float(error.max()), "pictures": len(error)}


def _empty(context: Context) -> dict[str, int] | None:
    if context.explainer.layer is None:
        return None
    return context.explainer.maps_without_heat(context.observations, context.actions)


def pointing_game(maps: NDArray, regions: NDArray, episode: NDArray) -> dict[str, Any]:
    """Return how often the hottest pixel is on the next target.

    Frames without a visible next target don't count; a map without heat misses.

    Args:
        maps: Shape (T, H, W), 0 or more.
        regions: `Region` of each pixel. Shape: (T, H, W).
        episode: Shape (T,).

    Returns:
        "hit", and "chance": the fraction of the frame that the target covers.
    """
    flat, target = _flat(maps), _flat(regions) == Region.NEXT_TARGET
    seen = target.any(1)
    hottest = flat.argmax(1)
    hit = target[np.arange(len(flat)), hottest] & (flat.max(1) > 0)
    return {
        "hit": mean_interval(np.where(seen, hit, np.nan), episode),
        "chance": mean_interval(np.where(seen, target.mean(1), np.nan), episode),
        "maps_without_heat": int((flat.max(1) <= 0).sum()),
    }


def heat_shares(maps: NDArray, regions: NDArray, episode: NDArray) -> dict[str, Any]:
    """Return the fractions of a map's heat on targets, horizon, ground and sky.

    Args:
        maps: Shape (T, H, W), 0 or more.
        regions: `Region` of each pixel. Shape: (T, H, W).
        episode: Shape (T,).

    Returns:
        By region name, "share" of the heat and "chance": the region's fraction of the frame.
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


def _flat(images: NDArray) -> NDArray:
    flat = images.reshape(len(images), -1)
    return flat.astype(np.float64) if np.issubdtype(flat.dtype, np.floating) else flat


def deletion_insertion(
    network: PictureNetwork,
    observations: Tensor,
    actions: Tensor,
    maps: Tensor,
    absent: Tensor,
    episode: NDArray,
) -> dict[str, Any]:
    """Return the action's probability as the hottest pixels are replaced first, or restored first.

    Pixels are replaced by the scene without targets. That scene has a most probable action of its
    own, so results are given for each action separately.

    Args:
        network: The policy's network.
        observations: Shape (T, C, h, w).
        actions: Shape (T,).
        maps: Shape (T, h, w).
        absent: Observation of the scene without targets. Shape: (C, h, w).
        episode: Shape (T,).

    Returns:
        By name of the action taken: "frames"; for "deletion" (lower is better) and "insertion"
        (higher is better) the "curve" at `SHARES`, a mean over episodes (None without frames), and
        the "area" under it with its interval.
    """
    rank = _ranks(maps)
    curves = {"deletion": [], "insertion": []}
    for share in SHARES:
        hottest = (rank < round(rank.shape[1] * rank.shape[2] * share))[:, None]
        for name, taken in (("deletion", hottest), ("insertion", ~hottest)):
            changed = torch.where(taken, absent, observations)
            curves[name].append(probabilities(network, changed).gather(1, actions[:, None])[:, 0])
    points = {n: torch.stack(curve, 1).double().numpy() for n, curve in curves.items()}
    found = {}
    for number, name in enumerate(actions_of(network).names):
        rows = (actions == number).numpy()
        summaries = {n: _summary(curve[rows], episode[rows]) for n, curve in points.items()}
        found[name] = {"frames": int(rows.sum()), **summaries}
    return found


def _ranks(maps: Tensor) -> Tensor:
    """Return each pixel's rank, hottest first, ties from top to bottom. Shape: (T, h, w)."""
    order = maps.flatten(1).argsort(dim=1, descending=True, stable=True)
    places = torch.arange(order.shape[1]).expand_as(order)
    return torch.empty_like(order).scatter_(1, order, places).view(maps.shape)


def _summary(curve: NDArray, episode: NDArray) -> dict[str, Any]:
    area = np.trapezoid(curve, SHARES, axis=1).clip(0.0, 1.0)
    means = [episode_means(point, episode) for point in curve.T]
    return {
        "curve": [float(m.mean()) for m in means] if len(curve) else None,
        "area": mean_bounds(episode_means(area, episode)),
    }
