"""Are the heat maps true? Held to what changing the scene does, beside maps that know nothing."""

from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
from numpy.typing import NDArray
from torch import Tensor

from drone_rl.explanations import interventions, trust, truth
from drone_rl.explanations.context import Context
from drone_rl.explanations.curves import SHARES, deletion_insertion
from drone_rl.explanations.intervals import mean_interval
from drone_rl.explanations.outcomes import outcomes
from drone_rl.explanations.trust import Trial


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
        "heat": {n: truth.heat_shares(maps, regions, episode) for n, maps in frames.items()},
        "cube": {n: truth.pointing_game(maps, regions, episode) for n, maps in frames.items()},
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
