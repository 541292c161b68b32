import mujoco
import pytest

from drone_rl.sim.meaning import Meaning
from drone_rl.sim.rendering import Scene
from drone_rl.utils.errors import InputError


def test_geoms_are_found_by_what_they_mean():
    model = mujoco.MjModel.from_xml_string("<mujoco/>")
    meanings = (Meaning.GROUND, Meaning.TARGET, Meaning.DRONE, Meaning.TARGET)
    scene = Scene(model, meanings, (-1, 0, -1, 1), (0.0, 0.0, 1.0))
    assert scene.geoms(Meaning.TARGET) == [1, 3]
    assert scene.geoms(Meaning.OBSTACLE) == []
    assert scene.seen(show_drone=True) == [0, 1, 2, 3]
    assert scene.seen(show_drone=False) == [0, 1, 3]


def test_cameras_are_found_by_name():
    cameras = '<camera name="a"/><camera name="b"/>'
    model = mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{cameras}</worldbody></mujoco>")
    scene = Scene(model, (), (), (0.0, 0.0, 1.0))
    assert (scene.camera("a"), scene.camera("b")) == (0, 1)
    with pytest.raises(InputError, match="camera 'c' is not in the model; choose from: a, b"):
        scene.camera("c")
