"""One shard of a batch, which can render fewer environments than its capacity."""

import mujoco
import pytest
import torch
import warp as wp

from drone_rl.sim.rendering import Appearance, Poses, View
from drone_rl.sim.rendering.mujoco_warp import Shard
from drone_rl.sim.rendering.scene import SemanticClass
from drone_rl.sim.worlds import Worlds

VIEW = View(cameras=("drone/front_center",), height=9, width=12)


@pytest.fixture(scope="module")
def scene():
    worlds = Worlds(1)
    yield worlds.scene
    worlds.close()


@pytest.fixture
def shard(scene):
    camera = mujoco.mj_name2id(scene.model, mujoco.mjtObj.mjOBJ_CAMERA, VIEW.cameras[0])
    with wp.ScopedDevice("cpu"):
        shard = Shard(scene, VIEW, camera, 3)
        shard.launch(1)
    return shard


def poses(*aside):
    """Return poses with a cube 5 m ahead and `aside` to the left, and two far behind."""
    count = len(aside)
    props = torch.full((count, 3, 3), -50.0)
    props[:, 0] = torch.tensor([[5.0, y, 2.0] for y in aside])
    attitude = torch.tensor([[1.0, 0.0, 0.0, 0.0]]).repeat(count, 1)
    return Poses(torch.tensor([[0.0, 0.0, 2.0]]).repeat(count, 1), attitude, props)


def draw(shard, of, appearance=None):
    out = torch.empty(len(of), 9, 12, 3, dtype=torch.uint8)
    shard.render(of, appearance, out)
    return out


def test_images_do_not_depend_on_other_environments(shard):
    both = draw(shard, poses(-2.0, 2.0))
    assert not torch.equal(both[0], both[1])
    for i, aside in enumerate((-2.0, 2.0)):
        assert torch.equal(draw(shard, poses(aside))[0], both[i])
    assert torch.equal(draw(shard, poses(-2.0, 2.0)), both)


def test_pixels_without_a_geom_are_the_sky(shard):
    plain = draw(shard, poses(0.0))
    blue = draw(shard, poses(0.0), Appearance(colors={SemanticClass.SKY: (0.0, 0.0, 1.0)}))
    assert blue[0, 0, 0].tolist() == [0, 0, 255]
    sky = (blue != plain).any(-1)[0]
    assert sky[0].all() and not sky[-1].any()  # above, not below
    assert torch.equal(draw(shard, poses(0.0)), plain)
