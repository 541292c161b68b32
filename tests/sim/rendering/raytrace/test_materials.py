"""Colors, lights, fog, shadows and textures as encoded for the kernels."""

import mujoco
import numpy as np
import pytest
import torch

from drone_rl.sim.rendering import Appearance, Scene, Texture
from drone_rl.sim.rendering.devices import start_warp
from drone_rl.sim.rendering.raytrace.materials import MaterialsEncoder
from drone_rl.sim.rendering.scene import SemanticClass
from drone_rl.sim.rendering.textures import load

TEXTURED = """<mujoco><worldbody><light/><geom type="plane" size="1 1 1"/><geom size="1"/>
<geom size="2"/></worldbody></mujoco>"""


MEANINGS = (SemanticClass.GROUND, SemanticClass.TARGET, SemanticClass.OBSTACLE)


ZENITH = torch.tensor([[0.2, 0.5, 1.0], [0.0, 0.0, 0.0]])


@pytest.fixture
def textured():
    start_warp("cpu")
    scene = Scene(mujoco.MjModel.from_xml_string(TEXTURED), MEANINGS, (-1, 0, 1), (0.0, 0.0, 0.0))
    return MaterialsEncoder(scene, "cpu")


def test_textures_are_stored_once(textured):
    ground = Texture(images=("grid", "bricks"), size=4.0, choice=torch.tensor([1, -1]))
    target = Texture(images=("bricks",), size=torch.tensor([0.5, 2.0]))
    appearance = Appearance(textures={SemanticClass.GROUND: ground, SemanticClass.TARGET: target})
    encoded = textured.encode_effects(appearance, ZENITH)
    assert encoded.texture.numpy().tolist() == [[1, 1, -1], [-1, 1, -1]]
    assert encoded.tiles.numpy().tolist() == [[0.25, 2.0, 0.0], [0.25, 0.5, 0.0]]
    assert encoded.sides.numpy().tolist() == [256, 256]
    count = (4**9 - 1) // 3  # of a texture of 256x256 texels with all mip levels
    assert encoded.starts.numpy().tolist() == [0, count]
    first = encoded.texels.numpy()[count : count + 256]
    red, green, blue = (load("bricks")[0, :, i] for i in range(3))
    assert np.array_equal(first, red + 256 * green.astype(int) + 65536 * blue.astype(int))
