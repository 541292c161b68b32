"""Where heat lies, by what the simulator knows to be there: not yet what moves a policy."""

from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from drone_rl.explanations import interventions, trust
from drone_rl.explanations.context import Context
from drone_rl.explanations.hooks import actions_of, probabilities
from drone_rl.explanations.interventions import outcomes
from drone_rl.explanations.scenes import Region
from drone_rl.explanations.trust import Trial
from drone_rl.policies import PictureNetwork
from drone_rl.utils.intervals import episode_means, mean_bounds, mean_interval


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
    flat, target = _flat(maps), _flat(regions) == Region.NEXT_TARGET
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


def _flat(pictures: NDArray) -> NDArray:
    flat = pictures.reshape(len(pictures), -1)
    return flat.astype(np.float64) if np.issubdtype(flat.dtype, np.floating) else flat


SHARES = (0.0, 0.01, 0.02, 0.03, 0.05, 0.075, 0.1, 0.15, 0.2, 0.3, 0.4, 0.6, 0.8, 1.0)
"""Of the pixels that are replaced. A far cube covers a hundredth of the picture."""


def deletion_insertion(
    network: PictureNetwork,
    observations: Tensor,
    actions: Tensor,
    maps: Tensor,
    absent: Tensor,
    episode: NDArray,
) -> dict[str, Any]:
    """The probability of the chosen action while pixels are taken away, or put back.

    Args:
        network: The policy's.
        observations: Shape (T, C, h, w).
        actions: Shape (T,).
        maps: Shape (T, h, w).
        absent: The scene without cubes. Shape: (C, h, w).
        episode: Shape (T,).

    Returns:
        By the name of the action that was taken, in small letters: "frames"; for "deletion" (lower
        is better) and "insertion" (higher is better) the "curve" at `SHARES`, the mean over
        episodes (None without frames), and the "area" under it with its interval.
    """
    rank = _ranks(maps)
    curves = {"deletion": [], "insertion": []}
    for share in SHARES:
        hottest = (rank < round(rank.shape[1] * rank.shape[2] * share))[:, None]
        for name, taken in (("deletion", hottest), ("insertion", ~hottest)):
            changed = torch.where(taken, absent, observations)
            curves[name].append(probabilities(network, changed).gather(1, actions[:, None])[:, 0])
    found = {}
    for number, name in enumerate(actions_of(network).names):
        rows = (actions == number).numpy()
        found[name] = {
            "frames": int(rows.sum()),
            **{
                name: _summary(torch.stack(points, 1).double().numpy()[rows], episode[rows])
                for name, points in curves.items()
            },
        }
    return found


def _ranks(maps: Tensor) -> Tensor:
    """The place of each pixel, the hottest first, ties from top to bottom. Shape: (T, h, w)."""
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


def section(context: Context) -> tuple[dict[str, Any], dict[str, NDArray]]:
    """Makes "truth".

    See `check_maps`, of no method where weights aren't known; besides "heat" of each method by
    region; "cube": is its brightest pixel on the next cube; "curves" of deletion and insertion, of
    placebos too; "interventions": what changes to the scene do at once; "outcomes": what becomes of
    flights (None if no picture has a next cube); "integration_error" of integrated gradients;
    "empty": why maps of Grad-CAM are.

    Arrays: "interventions" (K, H, W, 3): one frame after each change; "patch_effects" (rows,
    columns): how far each patch moves the policy, on average.
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
    flown = outcomes(context.scenes, network, state, episode)
    numbers = {
        **_maps(context, trial),
        **_places(context),
        "interventions": {c.name: mean_interval(c.effect, episode) for c in changes},
        "outcomes": flown if flown["flights"] else None,
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


def _maps(context: Context, trial: Trial) -> dict[str, Any]:
    """The tests of all methods, and curves of methods and placebos."""
    methods = trust.method_maps(context.explainer) if context.network.has_weights else {}
    maps = {name: trial.maps(method) for name, method in methods.items()}
    every = {**maps, **trial.placebos}
    asked = trial.network, trial.observations, trial.actions

    def curve(heat: Tensor) -> dict[str, Any]:
        return deletion_insertion(*asked, heat, context.absent, trial.episode)

    with ThreadPoolExecutor(2) as pool:
        curves = dict(zip(every, pool.map(curve, every.values()), strict=True))
    return {**trust.check_maps(trial, methods, maps), "curves": {"shares": SHARES, **curves}}


def _places(context: Context) -> dict[str, Any]:
    """Where the heat of each method lies."""
    regions, episode = context.dataset.regions, context.episode
    frames = {name: maps.numpy() for name, maps in context.frame_maps.items()}
    return {
        "heat": {n: heat_shares(maps, regions, episode) for n, maps in frames.items()},
        "cube": {n: pointing_game(maps, regions, episode) for n, maps in frames.items()},
    }


def _integration_error(context: Context, trial: Trial) -> dict[str, float] | None:
    """Mean and greatest error of the integral, on one picture an episode; None without any."""
    few = trial.thinned()
    if not len(few.actions) or not context.network.is_differentiable:
        return None
    error = context.explainer.completeness_error(few.observations, few.actions)
    return {"mean": float(error.mean()), "max": float(error.max()), "pictures": len(error)}


def _empty(context: Context) -> dict[str, int] | None:
    if context.explainer.layer is None:
        return None
    return context.explainer.maps_without_heat(context.observations, context.actions)
