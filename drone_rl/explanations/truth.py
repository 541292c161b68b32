"""Section "truth": tests of the heat maps against the effects of changes to the scene.

Besides the tests in `trust`: pixel-level deletion and insertion curves (Petsiuk et al., 2018), the
heat by region, and the interventions.
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
from drone_rl.utils.intervals import episode_means, mean_bounds, mean_interval

SHARES = (0.0, 0.01, 0.02, 0.03, 0.05, 0.075, 0.1, 0.15, 0.2, 0.3, 0.4, 0.6, 0.8, 1.0)
"""Fractions of the pixels that are replaced. A far cube covers a hundredth of the frame."""


def section(context: Context) -> tuple[dict[str, Any], dict[str, NDArray]]:
    """Return "truth".

    It has the results of `check_maps`, of no method if the weights are unknown; "heat" of each
    method by region; "curves" of deletion and insertion of methods and placebos; "interventions":
    effects of changes to the scene; "outcomes" of rollouts (None if no frame has a next target);
    "integration_error" of integrated gradients.

    Arrays: "interventions" (K, H, W, 3): one frame after each change; "patch_effects" (rows,
    columns): mean effect of each patch.
    """
    data, scenes, network = context.dataset, context.scenes, context.network
    episode, seed = context.episode, context.seed.value
    state = data.state(scenes.task, scenes.worlds.dynamics).to(context.device)
    trial = trust.make_trial(scenes, network, state, context.actions, episode, seed)
    changes = interventions.intervene(scenes, network, state, data.tensor("regions"), seed=seed)
    shown = int(np.argmax(np.nan_to_num(changes[0].effect)))
    outcomes = interventions.outcomes(scenes, network, state, episode)
    maps = {name: one.numpy() for name, one in context.frame_maps.items()}
    numbers = {
        **_tests(context, trial),
        "heat": {n: heat_shares(m, data.regions, episode) for n, m in maps.items()},
        "interventions": {c.name: mean_interval(c.effect, episode) for c in changes},
        "outcomes": outcomes if outcomes["flights"] else None,
        "integration_error": _integration_error(context, trial),
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
    with ThreadPoolExecutor(2) as pool:
        found = pool.map(
            lambda heat: deletion_insertion(trial, heat, context.absent), every.values()
        )
        curves = dict(zip(every, found, strict=True))
    return {**trust.check_maps(trial, methods, maps), "curves": {"shares": SHARES, **curves}}


def _integration_error(context: Context, trial: Trial) -> dict[str, float] | None:
    """Return mean and largest error of the integral, on one frame of each episode."""
    few = trial.thinned()
    if not len(few.actions) or not context.network.is_differentiable:
        return None
    error = context.explainer.completeness_error(few.observations, few.actions)
    return {"mean": float(error.mean()), "max": float(error.max()), "pictures": len(error)}


def heat_shares(maps: NDArray, regions: NDArray, episode: NDArray) -> dict[str, Any]:
    """Return the fractions of a map's heat on targets, horizon, ground and sky.

    Args:
        maps: Shape (T, H, W), 0 or more.
        regions: `Region` of each pixel. Shape: (T, H, W).
        episode: Shape (T,).

    Returns:
        By region name, "share" of the heat and "chance": the region's fraction of the frame.
    """
    flat = maps.reshape(len(maps), -1).astype(np.float64)
    areas = regions.reshape(flat.shape)
    total = flat.sum(1, keepdims=True)
    share = np.divide(flat, total, out=np.full_like(flat, np.nan), where=total > 0)
    return {
        region.name.lower(): {
            "share": mean_interval((share * (areas == region)).sum(1), episode),
            "chance": mean_interval((areas == region).mean(1), episode),
        }
        for region in Region
    }


def deletion_insertion(trial: Trial, maps: Tensor, absent: Tensor) -> dict[str, Any]:
    """Return the action's probability as the hottest pixels are replaced first, or restored first.

    Pixels of the trial's T observations are replaced by the scene without targets. That scene has a
    most probable action of its own, so results are given for each action separately.

    Args:
        trial: Observations, the actions taken, and their episodes.
        maps: Shape (T, h, w).
        absent: Observation of the scene without targets. Shape: (C, h, w).

    Returns:
        By name of the action taken: "frames"; for "deletion" (lower is better) and "insertion"
        (higher is better) the "curve" at `SHARES`, a mean over episodes (None without frames), and
        the "area" under it with its interval.
    """
    rank, actions = _ranks(maps), trial.actions
    curves = {"deletion": [], "insertion": []}
    for share in SHARES:
        hottest = (rank < round(rank.shape[1] * rank.shape[2] * share))[:, None]
        for name, taken in (("deletion", hottest), ("insertion", ~hottest)):
            wishes = probabilities(trial.network, torch.where(taken, absent, trial.observations))
            curves[name].append(wishes.gather(1, actions[:, None])[:, 0])
    points = {n: torch.stack(curve, 1).double().numpy() for n, curve in curves.items()}
    found = {}
    for number, name in enumerate(actions_of(trial.network).names):
        rows = (actions == number).numpy()
        summaries = {n: _summary(curve[rows], trial.episode[rows]) for n, curve in points.items()}
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
