"""A compiled model with semantic classes."""

import mujoco
import numpy as np
import pytest
from dm_control import mjcf

from drone_rl.sim.rendering import Scene
from drone_rl.sim.rendering.scene import SemanticClass, compiled
from drone_rl.utils.errors import InputError


def test_a_model_that_mujoco_rejects_is_named_with_its_reason():
    model = mjcf.RootElement()
    model.worldbody.add("geom", type="mesh", mesh="tree")
    message = (
        r"^scene=a\.xml can't be compiled .*\(Error: mesh 'tree' not found in geom 0\); correct"
    )
    with pytest.raises(InputError, match=message) as error:
        compiled(model, "scene=a.xml")
    assert "\n" not in str(error.value)


def test_cameras_are_found_by_name():
    cameras = '<camera name="a"/><camera name="b"/>'
    model = mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{cameras}</worldbody></mujoco>")
    scene = Scene(model, (), (), (0.0, 0.0, 1.0))
    assert (scene.camera("a"), scene.camera("b")) == (0, 1)
    with pytest.raises(InputError, match="camera 'c' is not in the model; choose from: a, b"):
        scene.camera("c")


def test_colors_default_to_the_material():
    xml = """<mujoco><asset><material name="m" rgba=".1 .2 .3 1"/></asset><worldbody>
    <geom size="1"/><geom size="1" material="m"/><geom size="1" material="m" rgba="1 0 0 1"/>
    <geom size="1" rgba="1 1 1 0"/></worldbody></mujoco>"""
    scene = Scene(
        mujoco.MjModel.from_xml_string(xml), (SemanticClass.TARGET,) * 4, (-1,) * 4, (0.0, 0.0, 1.0)
    )
    colors = [[0.5, 0.5, 0.5, 1], [0.1, 0.2, 0.3, 1], [1, 0, 0, 1], [1, 1, 1, 0]]
    np.testing.assert_allclose(scene.colors, colors, atol=1e-7)
    assert scene.shown(show_drone=True) == [0, 1, 2]  # the last geom is invisible
