import hashlib

import torch

from drone_rl.flight.image_types import palette, segmentation_ids
from drone_rl.sim.rendering.scene import SemanticClass
from drone_rl.sim.worlds import Worlds

FIRST = [[0, 0, 0], [153, 108, 6], [112, 105, 191], [89, 121, 72], [190, 225, 64], [206, 190, 59]]


def test_palette_is_airsims():
    colors = palette()
    assert (tuple(colors.shape), colors.dtype) == ((256, 3), torch.uint8)
    assert colors[:6].tolist() == FIRST
    assert colors[255].tolist() == [255, 255, 255]
    digest = hashlib.sha256(bytes(colors.flatten().tolist())).hexdigest()
    assert digest == "b7217dcebb91d590f6174c4ee7395e3fab3e7edde839d004789fd146a1f5de5e"


def test_ids_follow_from_names():
    """G, r, o, u, n, d: 103 + 114 + 111 + 117 + 110 + 100 = 655; 660 - 512 = 148."""
    scene = Worlds(1).scene
    ids = segmentation_ids(scene)
    assert len(ids) == scene.model.ngeom + 1 and ids[-1] == 0  # of the sky
    grounds = scene.geoms(SemanticClass.GROUND)
    assert ids[grounds].tolist() == [148] * len(grounds)
    assert len(set(ids[scene.geoms(SemanticClass.TARGET)].tolist())) == 1
