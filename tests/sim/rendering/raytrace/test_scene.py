"""Frames, cameras and rays of a model with nested, rotated bodies."""

import math

import mujoco
import numpy as np
import pytest

from drone_rl.sim.rendering import Scene, View
from drone_rl.sim.rendering.raytrace.scene import (
    Frames,
    make_camera,
    make_geoms,
    make_rays,
    make_view,
)
from drone_rl.sim.rendering.scene import SemanticClass

XML = """<mujoco><statistic extent="2"/><visual><map zfar="10"/></visual><worldbody>
<geom name="still" type="box" size="1 2 3" pos="1 2 3"/>
<body name="drone" pos="5 6 7" euler="0 0 90"><freejoint/>
  <geom name="hull" size=".5"/>
  <body name="arm" pos="1 0 0" euler="0 0 90"><geom name="tip" type="capsule" size=".1 .2"
    pos="0 0 1"/><camera name="eye" pos="0 1 0" fovy="90"/></body>
  <camera name="wide" fovy="120"/></body>
<body mocap="true" pos="9 9 9"><geom name="prop" type="cylinder" size=".3 .4" pos="0 .1 0"/></body>
</worldbody></mujoco>"""


@pytest.fixture(scope="module")
def scene():
    meanings = (
        SemanticClass.OBSTACLE,
        SemanticClass.DRONE,
        SemanticClass.DRONE,
        SemanticClass.TARGET,
    )
    model = mujoco.MjModel.from_xml_string(XML)
    return Scene(model, meanings, (-1, -1, -1, 0), (0.0, 0.0, 0.0))


def test_geoms_belong_to_their_frames(scene):
    geoms = make_geoms(scene, Frames(scene), show_drone=True, device="cpu")
    assert geoms.number.numpy().tolist() == [0, 1, 2, 3]
    assert geoms.frame.numpy().tolist() == [0, 1, 1, 2]
    positions = [[1, 2, 3], [0, 0, 0], [1, 0, 1], [0, 0.1, 0]]
    np.testing.assert_allclose(geoms.position.numpy(), positions, atol=1e-6)
    quarter = math.sqrt(0.5)
    np.testing.assert_allclose(geoms.attitude.numpy()[2], [quarter, 0, 0, quarter], atol=1e-6)


def test_bounding_boxes_of_geoms(scene):
    reach = make_geoms(scene, Frames(scene), show_drone=True, device="cpu").reach.numpy()
    expected = [[1, 2, 3], [0.5, 0.5, 0.5], [0.1, 0.1, 0.3], [0.3, 0.3, 0.4]]
    np.testing.assert_allclose(reach, expected, atol=1e-6)


def test_drone_can_be_hidden(scene):
    geoms = make_geoms(scene, Frames(scene), show_drone=False, device="cpu")
    assert geoms.number.numpy().tolist() == [0, 3]


def test_camera_belongs_to_its_frame(scene):
    camera = make_camera(scene, Frames(scene), "eye", aspect=2.0)
    assert camera.frame == 1
    # 1 m along the arm's y, the drone's -x, from the arm at (1, 0, 0)
    np.testing.assert_allclose(list(camera.position), [0, 0, 0], atol=1e-6)
    assert camera.half_height == pytest.approx(1.0)
    assert camera.half_width == pytest.approx(2.0)


def test_rays_pass_through_pixel_centers(scene):
    rays = make_rays(make_camera(scene, Frames(scene), "eye", aspect=2.0), 2, 4)
    assert rays.shape == (2, 4, 3) and rays.dtype == np.float32
    np.testing.assert_allclose(np.linalg.norm(rays, axis=-1), 1.0, atol=1e-6)
    np.testing.assert_allclose(rays[0, 0] / -rays[0, 0, 2], [-1.5, 0.5, -1.0], atol=1e-6)
    np.testing.assert_allclose(rays[1, 2] / -rays[1, 2, 2], [0.5, -0.5, -1.0], atol=1e-6)


def test_view_has_rays_for_each_camera(scene):
    view = View(cameras=("eye", "wide"), height=2, width=4)
    made = make_view(scene, Frames(scene), view, "cpu")
    assert (made.width, made.height) == (4, 2)
    assert made.far == pytest.approx(20.0)
    assert made.cameras.numpy()["half_height"].tolist() == pytest.approx([1.0, math.sqrt(3)])
    assert made.rays.shape == made.cosines.shape == (2, 8)
    first = made.rays.numpy()[:, 0]
    np.testing.assert_allclose(first[0] / -first[0, 2], [-1.5, 0.5, -1.0], atol=1e-6)
    np.testing.assert_allclose(
        first[1, :2] / -first[1, 2], np.sqrt(3) * first[0, :2] / -first[0, 2], rtol=1e-5
    )
    np.testing.assert_allclose(made.cosines.numpy()[:, 0], -first[:, 2])
