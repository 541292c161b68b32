"""A camera that is mounted otherwise in each world."""

import pytest
import torch

from drone_rl.sim.rendering import Appearance
from drone_rl.sim.rendering.scene import SemanticClass
from drone_rl.sim.worlds import Worlds
from drone_rl.trust.perturbations import mount
from drone_rl.utils.seeding import world_random_state

SWAY = torch.tensor([[1.0], [-0.5]], dtype=torch.float64)


def test_each_world_has_its_share_of_it():
    look = mount(offset=(0.0, 2.0, 1.0)).change(Appearance(), SWAY)
    assert look.camera.offset.tolist() == [[0.0, 2.0, 1.0], [0.0, -1.0, -0.5]]
    assert look.camera.turn.tolist() == [[1.0, 0.0, 0.0, 0.0]] * 2
    both = mount(turn="yaw", degrees=60.0).change(look, SWAY)
    assert both.camera.offset.tolist() == look.camera.offset.tolist()
    assert both.camera.turn[0].tolist() == pytest.approx([3**0.5 / 2, 0.0, 0.0, 0.5])


def test_the_look_is_otherwise_the_same():
    own = Appearance(colors={SemanticClass.GROUND: (0.1, 0.2, 0.3)}, fog_visibility=50.0)
    look = mount(degrees=5.0).change(own, SWAY)
    assert (look.colors, look.fog_visibility) == (own.colors, 50.0)


@pytest.mark.parametrize("renderer", ["raytrace", "mujoco_warp"])
def test_the_picture_is_that_of_a_camera_there(renderer):
    """Half a metre higher, the horizon stays and the near ground shrinks: as if the drone rose."""
    worlds = Worlds(1, num_shards=1, renderer=renderer)
    worlds.reset(torch.arange(1), [world_random_state(0, 0)])
    risen = worlds.poses(worlds.state)
    risen.position = risen.position + torch.tensor([0.0, 0.0, 0.5])
    look = mount(offset=(0.0, 0.0, 0.5)).change(Appearance(), SWAY[:1])
    here = worlds.poses(worlds.state)
    drawn = [
        worlds.renderer.render(worlds.policy_view, poses, look)["rgb"].clone()
        for poses, look in ((risen, None), (here, look), (here, None))
    ]
    worlds.close()
    assert torch.equal(drawn[0], drawn[1])
    assert not torch.equal(drawn[0], drawn[2])
