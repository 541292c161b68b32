from dm_control import mjcf

from drone_rl.sim.entities.cameras import CHASE, DRONE_CAMERAS
from drone_rl.sim.entities.drone import BODY_GROUP, Drone, hide_drone
from drone_rl.sim.meaning import Meaning
from drone_rl.sim.settings import CameraSettings


def test_a_hull_four_rotors_and_six_cameras():
    drone = Drone(size=0.8, camera=CameraSettings(width=40, height=40, horizontal_fov=90.0))
    model = mjcf.Physics.from_mjcf_model(drone.mjcf_model).model
    names = {model.geom(i).name for i in range(model.ngeom)}
    rotors = {f"rotor_{end}_{side}" for end in ("front", "rear") for side in ("left", "right")}
    assert names == {"hull"} | rotors
    assert model.geom("rotor_front_left").pos[:2].round(6).tolist() == [0.24, 0.24]
    assert (model.geom_group == BODY_GROUP).all() and model.body_mass.sum() == 1.0
    found = [model.camera(i).name for i in range(model.ncam)]
    assert found == [spec.name for spec in (*DRONE_CAMERAS, CHASE)]
    assert model.camera("front_center").fovy.round(6) == 90.0 and drone.meaning is Meaning.DRONE


def test_observables_are_off_until_a_task_enables_them():
    drone = Drone(size=0.8, camera=CameraSettings())
    assert not any(o.enabled for o in drone.observables.as_dict().values())


def test_its_own_cameras_leave_it_out():
    groups = hide_drone().geomgroup
    assert not groups[BODY_GROUP] and groups[0]
