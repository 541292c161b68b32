import mujoco

from drone_rl.sim.meaning import Meaning
from drone_rl.sim.rendering import Scene


def test_geoms_are_found_by_what_they_mean():
    model = mujoco.MjModel.from_xml_string("<mujoco/>")
    meanings = (Meaning.GROUND, Meaning.TARGET, Meaning.DRONE, Meaning.TARGET)
    scene = Scene(model, meanings, (-1, 0, -1, 1), (0.0, 0.0, 1.0))
    assert scene.geoms(Meaning.TARGET) == [1, 3]
    assert scene.geoms(Meaning.OBSTACLE) == []
