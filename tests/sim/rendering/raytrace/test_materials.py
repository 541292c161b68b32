"""Colors and lights as encoded for the kernel."""

import mujoco
import numpy as np
import pytest
import torch

from drone_rl.sim.rendering import Appearance, Scene
from drone_rl.sim.rendering.devices import start_warp
from drone_rl.sim.rendering.raytrace.materials import MaterialsEncoder
from drone_rl.sim.rendering.scene import SemanticClass

XML = """<mujoco><worldbody><light directional="true" dir="0 0 -1" ambient=".1 .1 .1"
diffuse=".5 .5 .5"/><geom name="a" type="plane" size="1 1 1" rgba=".2 .4 .6 1"/>
<geom name="b" size="1" rgba=".1 .1 .1 1"/></worldbody></mujoco>"""


@pytest.fixture
def materials():
    start_warp("cpu")
    model = mujoco.MjModel.from_xml_string(XML)
    meanings = (SemanticClass.GROUND, SemanticClass.TARGET)
    return MaterialsEncoder(Scene(model, meanings, (-1, 0), (0.2, 0.5, 1.0)), "cpu")


def test_environments_share_the_scenes_materials(materials):
    plain, _ = materials.encode(None, 7)
    np.testing.assert_allclose(plain.colors.numpy(), [[[0.2, 0.4, 0.6], [0.1, 0.1, 0.1]]])
    np.testing.assert_allclose(plain.diffuse.numpy(), [[[0.5, 0.5, 0.5]]])
    assert plain.sky.numpy().tolist() == [[51, 127, 255]]  # integers


def test_environments_can_differ_for_one_call(materials):
    ground = torch.tensor([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    appearance = Appearance(
        colors={SemanticClass.GROUND: ground, SemanticClass.SKY: (0.0, 0.0, 1.0)},
        sun=(0.3, 0.2, 0.1),
        sun_direction=(0.0, 3.0, -4.0),
    )
    encoded, effects = materials.encode(appearance, 2)
    assert effects is None
    assert encoded.colors.numpy()[:, 0].tolist() == ground.tolist()
    np.testing.assert_allclose(encoded.colors.numpy()[:, 1], [[0.1, 0.1, 0.1]] * 2)
    np.testing.assert_allclose(encoded.diffuse.numpy(), [[[0.3, 0.2, 0.1]]] * 2)
    np.testing.assert_allclose(encoded.direction.numpy(), [[[0.0, 0.6, -0.8]]] * 2, atol=1e-7)
    np.testing.assert_allclose(encoded.ambient.numpy(), [[[0.1, 0.1, 0.1]]] * 2)
    assert encoded.sky.numpy().tolist() == [[0, 0, 255]] * 2
    np.testing.assert_allclose(materials.encode(None, 2)[0].colors.numpy()[0, 0], [0.2, 0.4, 0.6])


def test_last_appearance_is_cached(materials):
    red, blue = (
        Appearance(colors={SemanticClass.SKY: c}) for c in ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    )
    encoded, _ = materials.encode(red, 2)
    assert materials.encode(red, 2)[0] is encoded
    assert materials.encode(red, 3)[0].sky.numpy().tolist() == [[255, 0, 0]] * 3
    assert materials.encode(blue, 2)[0].sky.numpy().tolist() == [[0, 0, 255]] * 2
    assert materials.encode(None, 2)[0].sky.numpy().tolist() == [[51, 127, 255]]
