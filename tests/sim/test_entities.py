"""Cameras, drone, field and props of a scene."""

import numpy as np
import pytest
from dm_control import mjcf

from drone_rl.sim import entities
from drone_rl.sim.entities import (
    FLOOR_COLOR,
    Field,
    make_distractors,
)
from drone_rl.sim.rendering.scene import SemanticClass
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


def test_arena_has_a_floor_and_a_sun_without_shadows():
    field = Field()
    model = mjcf.Physics.from_mjcf_model(field.mjcf_model).model
    assert (model.ngeom, model.nlight) == (1, 1) and field.semantic_class is SemanticClass.GROUND
    np.testing.assert_allclose(model.geom("floor").rgba[:3], FLOOR_COLOR, atol=1e-6)
    assert not model.light_castshadow[0] and model.light_dir[0, 2] < -0.5  # from above
    np.testing.assert_allclose(model.light_ambient[0] + 0.75, 1.1)  # full light is white


def test_distractors_cycle_through_all_shapes():
    made = make_distractors(4)
    assert [d.geom.type for d in made] == ["box", "sphere", "cylinder", "box"]
    assert all(d.semantic_class is SemanticClass.DISTRACTOR and d.geom.size[0] == 0.5 for d in made)
    assert len({d.mjcf_model.model for d in made}) == 4
