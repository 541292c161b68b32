"""Cameras that differ between environments, compared with environments of one camera."""

import math

import pytest
import torch

from drone_rl.config import CameraSettings
from drone_rl.sim.rendering import Appearance, Mounting
from drone_rl.sim.rendering.appearance import turned
from drone_rl.sim.worlds import Worlds
from drone_rl.utils.seeding import world_random_state

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


def test_previous_camera_is_not_reused(worlds):
    look = of(0, 1, 2)
    worlds.render(worlds.state, appearance=look)
    cameras, _ = worlds.renderer._views[worlds.policy_view]
    assert cameras.encode(look.camera, 3) is cameras.encode(look.camera, 3)
    assert cameras.encode(None, 3).cameras.shape == (1,)
    assert cameras.encode(look.camera, 3).cameras.shape == (3,)
