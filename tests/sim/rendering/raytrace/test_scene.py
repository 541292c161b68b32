"""Frames, cameras and rays of a model with nested bodies; cameras and sizes by environment."""

import dataclasses
import math

import mujoco
import numpy as np
import pytest
import torch

from drone_rl.config import CameraSettings
from drone_rl.sim.rendering import Appearance, Mounting, Scene, View
from drone_rl.sim.rendering.appearance import Distractors, turned
from drone_rl.sim.rendering.devices import start_warp
from drone_rl.sim.rendering.raytrace.scene import (
    Frames,
    PoseBuffers,
    make_geoms,
    make_view,
)
from drone_rl.sim.rendering.renderer import Poses
from drone_rl.sim.rendering.scene import SemanticClass
from drone_rl.sim.worlds import Worlds
from drone_rl.utils.seeding import world_random_state

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


FORM = torch.tensor([[0.0, 0.0, 0.0], [0.0, 0.5, 1.0], [-0.5, 0.0, 0.2]], dtype=torch.float64)


TURN = turned("pitch", torch.tensor([0.0, 10.0, -20.0]))


ZOOM = torch.tensor([1.0, 1.5, 0.8], dtype=torch.float64)


@pytest.fixture(scope="module")
def worlds():
    worlds = Worlds(3, num_shards=1)
    worlds.reset(torch.arange(3), [world_random_state(0, i) for i in range(3)])
    yield worlds
    worlds.close()


def of(*rows):
    rows = torch.tensor(rows)
    camera = Mounting(offset=FORM[rows], turn=TURN[rows], zoom=ZOOM[rows])
    return Appearance(camera=camera)


def test_each_environment_uses_its_own_camera(worlds):
    together = worlds.render(worlds.state, appearance=of(0, 1, 2))
    plain = worlds.render(worlds.state)
    assert torch.equal(together[0], plain[0])
    for i in (1, 2):
        alone = worlds.render(worlds.state[torch.tensor([i])], appearance=of(i))
        assert torch.equal(alone[0], together[i])
        assert not torch.equal(alone[0], plain[i])


def test_other_cameras_are_unchanged(worlds):
    view = worlds.view(("bottom_center", "front_center", "chase"), height=20, width=32)
    moved = worlds.render_all(worlds.state, view, of(0, 1, 2))["rgb"]
    plain = worlds.render_all(worlds.state, view)["rgb"]
    assert torch.equal(moved[:, [0, 2]], plain[:, [0, 2]])
    own = worlds.view(height=20, width=32)
    assert torch.equal(moved[:, 1], worlds.render(worlds.state, own, of(0, 1, 2)))


def test_zoom_equals_a_smaller_field_of_view(worlds):
    own, wide = (math.tan(math.radians(angle) / 2) for angle in (135.0, 150.0))
    zoomed = Appearance(camera=Mounting(zoom=own / wide))
    other = Worlds(3, camera=CameraSettings(horizontal_fov=150.0), num_shards=1)
    modalities = ("depth", "distance", "segmentation")
    found, expected = (
        w.render_all(worlds.state, w.view(modality=modalities), look)
        for w, look in ((worlds, zoomed), (other, None))
    )
    other.close()
    assert (found["segmentation"] != expected["segmentation"]).float().mean() < 0.002
    for name in ("depth", "distance"):
        far = (found[name] - expected[name]).abs() > 1e-3 * expected[name].abs()
        assert far.float().mean() < 0.01


@pytest.fixture(autouse=True)
def warp():
    """Start Warp."""
    start_warp("cpu")


def some(count, props=2):
    generator = torch.Generator().manual_seed(count)
    draw = (torch.rand(*size, generator=generator).double() for size in ((3,), (4,), (props, 3)))
    one = [values[None].repeat(count, *[1] * values.dim()) for values in draw]
    return Poses(*(v + torch.arange(count).reshape(-1, *[1] * (v.dim() - 1)) for v in one))


def test_pose_buffers_support_any_number_of_environments():
    places = PoseBuffers(torch.device("cpu"))
    for count, props in ((2, 2), (5, 2), (3, 2), (3, 1), (0, 1), (4, 0)):
        poses = some(count, props)
        made = places.write(poses)
        frames, attitudes = made.positions.numpy()[:count], made.attitudes.numpy()[:count]
        assert frames.shape == (count, 2 + props, 3) and (frames[:, 0] == 0).all()
        assert (frames[:, 1] == poses.position.float().numpy()).all()
        assert (frames[:, 2:] == poses.props.float().numpy()).all()
        assert (attitudes == poses.attitude.float().numpy()).all()


def test_sizes_of_distractors_hold_for_one_call():
    places = PoseBuffers(torch.device("cpu"))
    none = torch.zeros(1, 2, 3)
    given = Distractors(places=none, colors=none, sizes=torch.tensor([[0.5, 0.7]]))
    assert places.write(some(1), given).scales.numpy()[0].tolist() == pytest.approx(
        [1, 1, 0.5, 0.7]
    )
    fewer = dataclasses.replace(given, sizes=torch.tensor([[0.4]]))
    assert places.write(some(1), fewer).scales.numpy()[0].tolist() == pytest.approx([1, 1, 1, 0.4])
    assert places.write(some(1)).scales.numpy()[0].tolist() == [1, 1, 1, 1]
