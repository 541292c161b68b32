"""Frames, cameras and rays of a model with nested bodies; cameras and sizes by environment."""

import dataclasses
import math

import mujoco
import numpy as np
import pytest
import torch

from drone_rl.config import CameraSettings
from drone_rl.sim.rendering import Appearance, Mounting, Scene
from drone_rl.sim.rendering.appearance import Distractors, turned
from drone_rl.sim.rendering.devices import start_warp
from drone_rl.sim.rendering.raytrace.scene import (
    Frames,
    PoseBuffers,
    make_geoms,
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


def test_sizes_of_distractors_hold_for_one_call():
    one = Poses(torch.zeros(1, 3), torch.zeros(1, 4), torch.zeros(1, 2, 3))
    places = PoseBuffers(torch.device("cpu"))
    none = torch.zeros(1, 2, 3)
    given = Distractors(places=none, colors=none, sizes=torch.tensor([[0.5, 0.7]]))
    assert places.write(one, given).scales.numpy()[0].tolist() == pytest.approx([1, 1, 0.5, 0.7])
    fewer = dataclasses.replace(given, sizes=torch.tensor([[0.4]]))
    assert places.write(one, fewer).scales.numpy()[0].tolist() == pytest.approx([1, 1, 1, 0.4])
    assert places.write(one).scales.numpy()[0].tolist() == [1, 1, 1, 1]
