"""Where it looks: heat maps of all frames, and which frames tell an episode's story."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from drone_rl.explain.context import Context
from drone_rl.explain.sequence import choose_episode, key_frames


def section(context: Context) -> tuple[dict[str, Any], dict[str, NDArray]]:
    """Makes "attribution"; arrays "map_..." (T, H, W) of each method, each frame's peak 1."""
    arrays = {}
    for name, maps in context.frame_maps.items():
        peak = maps.flatten(1).amax(1).clamp_min(1e-30)[:, None, None]
        arrays[f"map_{name}"] = (maps / peak).numpy().astype(np.float16)
    data = context.dataset
    episode = choose_episode(data)
    numbers = {
        "layer": context.explainer.layer,
        "methods": list(context.maps),
        "episode": episode,
        "sequence": [{"frame": frame, "why": why} for frame, why in key_frames(data, episode)],
    }
    return {"attribution": numbers}, arrays
