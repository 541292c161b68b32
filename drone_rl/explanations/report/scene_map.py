"""Report section "scene_map": paths on the floor plans of scenes."""

from PIL import Image

from drone_rl.explanations.report.part import Part
from drone_rl.explanations.results import Explanation, SceneMap


def draw(scene_map: SceneMap, explanation: Explanation) -> dict[str, Image.Image]:
    """Return the maps, one below the other."""
    del explanation
    return {"scene_map": Image.fromarray(scene_map.picture)}


PART = Part(title="Map", label="Map", draw=draw)
