"""Are the heat maps true? Held to what changing the scene does, beside maps that know nothing."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from drone_rl.explain import interventions, trust, truth
from drone_rl.explain.context import Context
from drone_rl.explain.intervals import mean_interval


def section(context: Context) -> tuple[dict[str, Any], dict[str, NDArray]]:
    """Makes "truth"; array "interventions" (K, H, W, 3): one frame after each change."""
    data, network, seed = context.dataset, context.network, context.settings.seed
    state, episode = data.state(), context.episode
    trial = trust.make_trial(context.scenes, network, state, context.actions, episode, seed)
    changes = interventions.intervene(
        context.scenes, network, state.to(context.env.device), data.tensor("regions"), seed=seed
    )
    shown = int(np.argmax(np.nan_to_num(changes[0].effect)))
    numbers = {
        **trust.check_maps(trial, trust.method_maps(context.explainer)),
        "heat": {
            name: truth.heat_shares(maps.numpy(), data.regions, episode)
            for name, maps in context.frame_maps.items()
        },
        "interventions": {c.name: mean_interval(c.effect, episode) for c in changes},
        "shown_frame": shown,
    }
    arrays = {"interventions": np.stack([c.frames[shown].cpu().numpy() for c in changes])}
    return {"truth": numbers}, arrays
