import hashlib

import torch

from drone_rl.sim.image_types import palette, segmentation_ids
from drone_rl.sim.rendering.scene import SemanticClass
from drone_rl.sim.worlds import Worlds

FIRST = [[0, 0, 0], [153, 108, 6], [112, 105, 191], [89, 121, 72], [190, 225, 64], [206, 190, 59]]


def test_colors_are_those_of_airsim():
    colors = palette()
    assert (tuple(colors.shape), colors.dtype) == ((256, 3), torch.uint8)
    assert colors[:6].tolist() == FIRST
    assert colors[255].tolist() == [255, 255, 255]
    digest = hashlib.sha256(bytes(colors.flatten().tolist())).hexdigest()
    assert digest == "b7217dcebb91d590f6174c4ee7395e3fab3e7edde839d004789fd146a1f5de5e"


def test_default_ids_follow_from_names():
    """G, r, o, u, n, d: 103 + 114 + 111 + 117 + 110 + 100 = 655; 660 - 512 = 148."""
    assert default_id("ground") == default_id("Ground") == 148
    assert default_id("target_0") == default_id("target_12")
    assert default_id("") == 5


def test_every_geom_has_the_id_of_its_name():
    scene = Worlds(1).scene
    ids = segmentation_ids(scene)
    assert len(ids) == scene.model.ngeom
    grounds = scene.geoms(SemanticClass.GROUND)
    assert default_ids(scene)[grounds].tolist() == [148] * len(grounds)


def test_invalid_ids_raise():
    assert check_ids(torch.tensor([0, 255]), 2).tolist() == [0, 255]
    with pytest.raises(InputError, match=r"ids of shape \(2,\) don't fit 3 geoms"):
        check_ids(torch.tensor([0, 255]), 3)
    for bad in (-1, 256):
        with pytest.raises(InputError, match=f"id {bad} is out of range; give whole numbers"):
            check_ids(torch.tensor([0, bad]), 2)
    with pytest.raises(InputError, match=r"id 0.5 is out of range"):
        check_ids(torch.tensor([0.5]), 1)
