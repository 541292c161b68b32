"""Cameras, drone, field and props of a scene."""

import numpy as np
import pytest
from dm_control import mjcf

from drone_rl.config import CameraSettings
from drone_rl.sim import entities
from drone_rl.sim.entities import (
    BODY_GROUP,
    CHASE,
    DRONE_CAMERAS,
    FLOOR_COLOR,
    Cube,
    DroneEntity,
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


def test_cube_is_a_box_without_collisions():
    cube = Cube(2.5, (0.1, 0.2, 0.3), name="cube_7")
    model = mjcf.Physics.from_mjcf_model(cube.mjcf_model).model
    assert model.geom_size[0].tolist() == [1.25] * 3  # half edges
    np.testing.assert_allclose(model.geom_rgba[0, :3], (0.1, 0.2, 0.3), atol=1e-6)
    assert not model.geom_contype.any() and not model.geom_conaffinity.any()
    assert cube.mjcf_model.model == "cube_7" and cube.semantic_class is SemanticClass.TARGET
    assert cube.geom is cube.mjcf_model.find("geom", "geom")


def test_distractors_cycle_through_all_shapes():
    made = make_distractors(4)
    assert [d.geom.type for d in made] == ["box", "sphere", "cylinder", "box"]
    assert all(d.semantic_class is SemanticClass.DISTRACTOR and d.geom.size[0] == 0.5 for d in made)
    assert len({d.mjcf_model.model for d in made}) == 4


def test_drone_has_hull_four_rotors_and_six_cameras():
    drone = DroneEntity(size=0.8, camera=CameraSettings(width=40, height=40, horizontal_fov=90.0))
    model = mjcf.Physics.from_mjcf_model(drone.mjcf_model).model
    names = {model.geom(i).name for i in range(model.ngeom)}
    rotors = {f"rotor_{end}_{side}" for end in ("front", "rear") for side in ("left", "right")}
    assert names == {"hull"} | rotors
    assert model.geom("rotor_front_left").pos[:2].round(6).tolist() == [0.24, 0.24]
    assert (model.geom_group == BODY_GROUP).all() and model.body_mass.sum() == 1.0
    found = [model.camera(i).name for i in range(model.ncam)]
    assert found == [spec.name for spec in (*DRONE_CAMERAS, CHASE)]
    assert (
        model.camera("front_center").fovy.round(6) == 90.0
        and drone.semantic_class is SemanticClass.DRONE
    )
