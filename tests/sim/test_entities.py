import numpy as np
import pytest
from dm_control import mjcf

from drone_rl.sim import entities
from drone_rl.utils.errors import InputError

LOOKS = {
    "front_center": (1, 0, 0),
    "front_right": (1, 0, 0),
    "front_left": (1, 0, 0),
    "bottom_center": (0, 0, -1),
    "back_center": (-1, 0, 0),
}


@pytest.mark.parametrize("spec", entities.DRONE_CAMERAS, ids=lambda spec: spec.name)
def test_cameras_have_the_direction_of_their_name(spec):
    root = mjcf.RootElement()
    camera = entities.add_camera(root.worldbody.add("body", name="body"), spec, vertical_fov=40.0)
    physics = mjcf.Physics.from_mjcf_model(root)
    right, up, back = physics.bind(camera).xmat.reshape(3, 3).T
    np.testing.assert_allclose(-back, LOOKS[spec.name], atol=1e-9)
    np.testing.assert_allclose(physics.bind(camera).xpos, spec.pos)
    assert physics.bind(camera).fovy == 40.0
    side = {"front_left": 1, "front_right": -1}.get(spec.name, 0)
    assert np.sign(spec.pos[1]) == side
    assert up[2] == pytest.approx(1.0) or spec.name == "bottom_center"
    assert right[1] == pytest.approx(1.0 if spec.name == "back_center" else -1.0)


def test_cameras_are_found_by_airsims_names_and_numbers():
    for number, name in enumerate(LOOKS):
        for known in (name, str(number), number):
            assert entities.find_camera(known).name == name
    assert entities.find_camera("").name == entities.find_camera("fpv").name == "front_center"
    assert entities.find_camera("3").name == "bottom_center"
    with pytest.raises(InputError, match=r"camera 'nose' is unknown; choose from: front_c"):
        entities.find_camera("nose")


def test_positions_of_cameras():
    """Offsets are in meters forward, left and up from the drone's center."""
    places = {spec.name: spec.pos for spec in (*entities.DRONE_CAMERAS, entities.CHASE)}
    assert places == {
        "front_center": (0.4, 0.0, 0.0),
        "front_right": (0.4, -0.25, 0),
        "front_left": (0.4, 0.25, 0),
        "bottom_center": (0, 0, -0.1),
        "back_center": (-0.4, 0, 0),
        "chase": (-7.0, 0, 3.5),
    }
