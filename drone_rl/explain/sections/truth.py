"""Are the heat maps true? Held to what the simulator knows, and to what changing the scene does."""

from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from drone_rl.explain import interventions, truth
from drone_rl.explain.context import Context

MOVED = 0.01
"""Mean effect of a change to the scene below which it counts as none."""


def section(context: Context) -> tuple[dict[str, Any], dict[str, NDArray]]:
    """Makes "truth"; array "interventions" (K, H, W, 3): one frame after each change."""
    data, network, seed = context.dataset, context.network, context.settings.seed
    state = data.state().to(context.env.device)
    changes = interventions.intervene(
        context.scenes, network, state, data.tensor("regions"), seed=seed
    )
    methods = {name: _check(context, name, changes) for name in context.maps}
    random = torch.rand(
        context.maps["saliency"].shape, generator=torch.Generator().manual_seed(seed)
    )
    effects = {c.name: truth.mean_interval(c.effect, data.episode) for c in changes}
    moved = max((effect["mean"] or 0.0) for effect in effects.values())
    shown = int(np.argmax(np.nan_to_num(changes[0].effect)))
    numbers = {
        "methods": methods,
        "random_map": _curves(context, random),
        "interventions": effects,
        "moved_by_anything": moved >= MOVED,
        "trusted": _trusted(methods) if moved >= MOVED else None,
        "shown_frame": shown,
    }
    arrays = {"interventions": np.stack([c.frames[shown].cpu().numpy() for c in changes])}
    return {"truth": numbers}, arrays


def _check(
    context: Context, name: str, changes: list[interventions.Intervention]
) -> dict[str, Any]:
    """All tests of one method."""
    regions, episode = context.dataset.regions, context.episode
    on_frame = context.frame_maps[name]
    return {
        "pointing": truth.pointing_game(on_frame.numpy(), regions, episode),
        "heat": truth.heat_shares(on_frame.numpy(), regions, episode),
        "curves": _curves(context, context.maps[name]),
        "randomisation": truth.randomisation_test(
            context.explainer,
            name,
            context.observations,
            context.actions,
            seed=context.settings.seed,
        ),
        "causal": interventions.agreement(on_frame, changes, episode),
    }


def _curves(context: Context, maps: torch.Tensor) -> dict[str, Any]:
    return truth.deletion_insertion(
        context.network,
        context.observations,
        context.actions,
        maps,
        context.absent,
        context.episode,
    )


def _trusted(methods: dict[str, Any]) -> str | None:
    """The method whose claims agree best with the interventions, among those that may be trusted.

    It must pass the randomisation test, and the whole interval of its agreement must lie above 0.
    """
    able = {
        name: found["causal"]["correlation"]
        for name, found in methods.items()
        if found["randomisation"]["passed"] and (found["causal"]["lower95"] or -1.0) > 0
    }
    return max(able, key=lambda name: able[name]) if able else None
