"""Scenes by name, and MJCF files."""

import math

import numpy as np
import pytest
import torch

from drone_rl.flight.airsim.messages import Pose
from drone_rl.flight.airsim.scenes import make_task
from drone_rl.flight.airsim.settings_file import AirsimSettings
from drone_rl.flight.airsim.simulation import Simulation
from drone_rl.flight.airsim.stage import Stage
from drone_rl.flight.image_types import ImageType
from drone_rl.flight.settings import ServeSettings
from drone_rl.sim.coordinates import GeoPoint
from drone_rl.sim.worlds import Worlds
from drone_rl.utils.errors import InputError
from tests.flight.airsim.flying import fly
from tests.flight.airsim.looking import look

SAME = (math.nan,) * 4


def test_blocks_can_be_touched_and_a_file_is_shown(tmp_path):
    blocks = Stage("blocks", 0)
    assert {"OrangeBall", "PulsingCone", "Cylinder", "SkySphere"} < {*blocks.names}
    around = blocks.task.obstacles(blocks.worlds.state)
    assert tuple(around.half_sizes) == (2.0, 2.0, 2.0)
    assert around.centers.shape[1] == len(blocks.find("block_.*"))
    x, y, z = blocks.object_pose("OrangeBall").position
    depth = look(
        blocks, kind=ImageType.DEPTH_PLANAR, position=(x - 3.4, -y, -z)
    )  # camera 0.4 m ahead
    assert float(depth[9, 16]) == pytest.approx(2.0, abs=0.02)  # its radius is 1 m
    assert blocks.move_object("PulsingCone", (9.0, 0.0, 1.25))
    assert blocks.object_pose("PulsingCone").position == (9.0, 0.0, -1.25)
    blocks.close()
    path = tmp_path / "house.xml"
    path.write_text(
        '<mujoco model="house"><asset><mesh name="tent" vertex="0 0 0 1 0 0 0 1 0 0 0 1"/></asset>'
        '<worldbody><body name="hall"><geom name="wall" type="box" size="1 4 4" pos="11.4 0 4" '
        'rgba="1 0 0 1"/></body><geom name="tent" type="mesh" mesh="tent" pos="-5 2 1"/>'
        "</worldbody></mujoco>"
    )
    house = Stage(str(path), 0)
    assert "wall" in house.names
    assert house.object_pose("wall").position == pytest.approx((11.4, 0.0, -4.0))
    assert house.object_pose("wall").attitude == pytest.approx((1.0, 0.0, 0.0, 0.0))
    tent = house.object_pose("tent")  # not its centre of mass
    assert tent.position == pytest.approx((-5.0, -2.0, -1.0), abs=1e-6)
    assert tent.attitude == pytest.approx((1.0, 0.0, 0.0, 0.0), abs=1e-6)
    assert not house.move_object("wall", (0.0, 0.0, 0.0))
    depth = look(house, kind=ImageType.DEPTH_PLANAR)  # in a file the camera is in the drone
    assert 10.4 - house.task.drone_size / 2 <= float(depth[9, 16]) < 10.4
    for name, number, is_pattern in (("wall", 7, False), (".*", 0, True), ("wall", 9, False)):
        assert house.set_id(name, number, is_pattern=is_pattern)
    assert house.get_id("wall") == 9
    assert house.move_object("house", (10.0, math.nan, math.nan))
    assert house.object_pose("wall").position == pytest.approx((21.4, 0.0, -4.0))
    house.close()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("<mujoco><", "is no XML"),
        (
            '<mujoco><worldbody><geom type="mesh" mesh="tree"/></worldbody></mujoco>',
            r"^scene=.*bad\.xml: line 1 of bad\.xml.*mesh 'tree' not found in geom 0",
        ),
    ],
)
def test_crafted_files_are_refused(tmp_path, text, message):
    (tmp_path / "bad.xml").write_text(text)
    with pytest.raises(InputError, match=message):
        Stage(str(tmp_path / "bad.xml"), 0)
    with pytest.raises(InputError, match=r"scene=no\.xml: it does not exist; give indoor"):
        Stage("no.xml", 0)
    with pytest.raises(InputError, match=r"scene=blokcs is unknown; give cubes.*blocks"):
        Stage("blokcs", 0)


def test_vehicles_collide_with_a_file_and_start_below_its_start(tmp_path):
    path = tmp_path / "house.xml"
    path.write_text(
        '<mujoco><worldbody><geom name="floor" type="plane" size="9 9 1" pos="0 0 5"/>'
        '<geom name="wall" type="box" size=".1 4 4" pos="4 0 8" euler="0 0 30"/>'
        '<site name="start" pos="2 0 6"/></worldbody></mujoco>'
    )
    simulation = Simulation(AirsimSettings(), ServeSettings(scene=str(path), clock="lockstep"))
    assert simulation.stage.object_pose("wall").position == pytest.approx((2.0, 0.0, -3.0))
    (vehicle,) = simulation.vehicles.values()
    there = Pose((9.0, 0.0, -3.0), vehicle.pose.attitude)
    vehicle.set_airsim_pose(Pose((0.0, 0.0, -3.0), there.attitude), ignore_collision=False)
    vehicle.set_airsim_pose(there, ignore_collision=False)
    reach = vehicle.settings.radius + 0.1
    assert vehicle.pose.position[0] == pytest.approx(2.0 - reach / math.cos(math.pi / 6), abs=0.01)
    assert vehicle.collision()["object_name"] == "wall"
    assert vehicle.sees(GeoPoint(*vehicle.geo_point().values()))
    simulation.close()


@pytest.mark.parametrize("site", ['<site name="start" type="box" size="2 2 .2" pos="2 0 1"/>', ""])
def test_vehicles_start_on_the_floor_where_they_are_free(tmp_path, site):
    """Not on the table in the middle of the start, nor in the post at the file's origin."""
    path = tmp_path / "house.xml"
    path.write_text(
        '<mujoco><worldbody><geom name="floor" type="box" size="6 6 .1" pos="0 0 -.1"/>'
        '<geom name="table" type="cylinder" size=".6 .1" pos="2 0 .4"/>'
        f'<geom name="post" type="box" size=".2 .2 2" pos="0 0 2"/>{site}</worldbody></mujoco>'
    )
    simulation = Simulation(AirsimSettings(), ServeSettings(scene=str(path), clock="lockstep"))
    (vehicle,) = simulation.vehicles.values()
    radius = vehicle.settings.radius
    assert float(vehicle.body.position[0, 2]) == pytest.approx(radius)
    assert simulation.stage.object_pose("floor").position[2] == pytest.approx(0.1)
    near = "table" if site else "post"
    away = math.hypot(*simulation.stage.object_pose(near).position[:2])
    assert 0.2 + radius <= away < 1.5
    simulation.close()


def test_vehicles_fly_into_the_walls_of_a_file_and_land_on_its_floor(tmp_path):
    """The wall is one mesh with single triangles; the floor is 3 m deeper behind an edge."""
    path = tmp_path / "house.xml"
    path.write_text(
        '<mujoco><asset><mesh name="wall" inertia="shell" face="0 1 2 0 2 3" '
        'vertex="5 -9 -9  5 9 -9  5 9 9  5 -9 9"/></asset><worldbody>'
        '<geom name="step" type="box" size="1 1 1" pos="0 0 -1"/>'
        '<geom name="floor" type="plane" size="9 9 1" pos="0 0 -3"/>'
        '<body name="house"><geom type="mesh" mesh="wall"/></body></worldbody></mujoco>'
    )
    simulation = Simulation(AirsimSettings(), ServeSettings(scene=str(path), clock="lockstep"))
    (vehicle,) = simulation.vehicles.values()
    vehicle.has_api_control = True
    assert vehicle.set_armed(True)
    fly(vehicle, vehicle.take_off())
    assert not vehicle.collision()["has_collided"]
    fly(vehicle, vehicle.move_by_velocity(4.0, 0.0, 0.0, 4.0))
    found, radius = vehicle.collision(), vehicle.settings.radius
    assert found["has_collided"] and found["object_name"] == "house"
    assert found["object_id"] == simulation.stage.get_id("house") > 0
    assert found["impact_point"]["x_val"] == pytest.approx(5.0, abs=0.02)
    assert vehicle.pose.position[0] <= 5.0 - radius + 1e-4
    there = GeoPoint(*vehicle.geo_point().values())
    vehicle.set_airsim_pose(Pose((2.0, 0.0, -1.0), SAME), ignore_collision=False)
    assert vehicle.sees(there)
    fly(vehicle, vehicle.land())
    assert float(vehicle.body.position[0, 2]) == pytest.approx(radius - 3.0, abs=0.01)
    assert vehicle.collision()["object_name"] == "floor"
    simulation.close()


@pytest.mark.parametrize(
    "setting",
    [
        "",
        '<compiler angle="degree"/><option gravity="0 0 -9.81"/><statistic extent="20"/>'
        '<visual><rgba haze="0.1 0.2 0.3 1"/></visual>',
    ],
)
def test_a_files_angles_are_degrees_and_its_settings_do_not_matter(tmp_path, setting):
    path = tmp_path / "house.xml"
    path.write_text(
        f'<mujoco model="house">{setting}<worldbody><geom name="wall" type="box" size="1 4 4" '
        'pos="11 0 4" euler="0 0 45"/></worldbody></mujoco>'
    )
    house = Stage(str(path), 0)
    assert house.object_pose("wall").attitude == pytest.approx((0.92388, 0, 0, -0.38268), abs=1e-4)
    house.close()


def test_the_lights_of_a_file_are_on_wherever_its_start_is(tmp_path):
    """The file is placed so that its start is above the origin, here 10 or 200 m below it."""
    means = []
    for high in (10, 200):
        path = tmp_path / f"hill_{high}.xml"
        path.write_text(
            '<mujoco><visual><headlight active="0"/></visual><worldbody>'
            '<light directional="true" dir="1 0 -1" diffuse="0.8 0.8 0.8" castshadow="false"/>'
            f'<geom type="box" size="9 9 5" pos="0 0 {high - 5}"/>'
            f'<site name="start" pos="0 0 {high + 1}"/></worldbody></mujoco>'
        )
        worlds = Worlds(1, make_task(str(path)))
        worlds.reset(torch.arange(1), [np.random.RandomState(0)])
        means.append(float(worlds.render(worlds.state).float().mean()))
    assert means[0] == means[1] > 10
