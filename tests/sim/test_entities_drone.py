from dm_control import mjcf

from drone_rl.config import CameraSettings
from drone_rl.sim.entities import BODY_GROUP, CHASE, DRONE_CAMERAS, Drone, hide_drone
from drone_rl.sim.rendering.scene import SemanticClass


def test_drone_has_hull_four_rotors_and_six_cameras():
    drone = Drone(size=0.8, camera=CameraSettings(width=40, height=40, horizontal_fov=90.0))
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


def test_observables_are_off_until_a_task_enables_them():
    drone = Drone(size=0.8, camera=CameraSettings())
    assert not any(o.enabled for o in drone.observables.as_dict().values())


def test_own_cameras_hide_the_drone():
    groups = hide_drone().geomgroup
    assert not groups[BODY_GROUP] and groups[0]


def test_dimensions_scale_with_the_size():
    """Sizes of a 1 m drone: half extents of the hull, radius and half height of rotors."""
    drone = Drone(size=1.0, camera=CameraSettings())
    model = mjcf.Physics.from_mjcf_model(drone.mjcf_model).model
    assert model.geom("hull").size.round(6).tolist() == [0.3, 0.18, 0.1]
    places = {"front": 0.3, "rear": -0.3}, {"left": 0.3, "right": -0.3}
    for end, x in places[0].items():
        for side, y in places[1].items():
            rotor = model.geom(f"rotor_{end}_{side}")
            assert rotor.pos.round(6).tolist() == [x, y, 0.12]
            assert rotor.size[:2].round(6).tolist() == [0.2, 0.02]
    small = mjcf.Physics.from_mjcf_model(Drone(size=0.5, camera=CameraSettings()).mjcf_model).model
    assert small.geom("hull").size.round(6).tolist() == [0.15, 0.09, 0.05]
    assert small.geom("rotor_rear_left").size[:2].round(6).tolist() == [0.1, 0.01]
