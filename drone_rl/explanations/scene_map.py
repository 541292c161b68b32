"""Section "scene_map": paths of episodes on the floor plans of scene files."""

import io
from typing import Any

import numpy as np
from PIL import Image

from drone_rl.explanations.context import Context
from drone_rl.explanations.results import SceneMap
from drone_rl.trust.plots.images import stacked
from drone_rl.trust.plots.saving import to_png
from drone_rl.trust.scene_map import by_start, draw_map, fly_paths


def section(context: Context) -> SceneMap | None:
    """Draw the map of each scene file; None without any."""
    task: Any = context.scenes.task
    if not getattr(task, "scenes", ()):
        return None
    paths = fly_paths(context.env, context.restart())
    maps = []
    for number, scene in enumerate(task.surroundings):
        if own := [path for path in paths if path.scene == number]:
            maps.append(Image.open(io.BytesIO(to_png(draw_map(scene, own)))).convert("RGB"))
    return SceneMap(by_start=by_start(paths), picture=np.array(stacked(maps)))
