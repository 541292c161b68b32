"""A camera that is mounted otherwise, by hand and against the renderer."""

import math

import pytest
import torch

from drone_rl.conditions.mounting import Mount, product, rotate
from drone_rl.sim.rendering import Poses
from drone_rl.sim.worlds import Worlds
from drone_rl.utils.seeding import world_random_state

LEVEL = torch.tensor([[1.0, 0.0, 0.0, 0.0]], dtype=torch.float64)


def poses():
    return Poses(torch.tensor([[5.0, 1.0, 2.5]], dtype=torch.float64), LEVEL, torch.zeros(1, 1, 3))


def camera(found):
    """Where the camera is and which way it looks, from the drone's pose."""
    ahead = torch.tensor([1.0, 0.0, 0.0], dtype=torch.float64)
    where = found.position + rotate(found.attitude, 0.4 * ahead)
    return where[0].tolist(), rotate(found.attitude, ahead)[0].tolist()


def test_a_turned_camera_stays_where_it_is():
    sway = torch.ones(1, 1, dtype=torch.float64)
    where, ahead = camera(Mount(turn="yaw", degrees=90.0)(poses(), sway))
    assert where == pytest.approx([5.4, 1.0, 2.5])
    assert ahead == pytest.approx([0.0, 1.0, 0.0])  # to the left
    where, ahead = camera(Mount(turn="pitch", degrees=30.0)(poses(), -sway))
    assert where == pytest.approx([5.4, 1.0, 2.5])
    assert ahead == pytest.approx([math.cos(math.pi / 6), 0.0, 0.5])  # up, the opposite way
    where, ahead = camera(Mount(turn="roll", degrees=45.0)(poses(), sway))
    assert (where, ahead) == (pytest.approx([5.4, 1.0, 2.5]), pytest.approx([1.0, 0.0, 0.0]))


def test_a_moved_camera_looks_the_same_way():
    sway = torch.tensor([[-0.5]], dtype=torch.float64)
    where, ahead = camera(Mount(offset=(0.0, 2.0, 1.0))(poses(), sway))
    assert where == pytest.approx([5.4, 0.0, 2.0])
    assert ahead == pytest.approx([1.0, 0.0, 0.0])


def test_two_mounts_act_one_after_the_other():
    sway = torch.ones(1, 1, dtype=torch.float64)
    turned = Mount(turn="yaw", degrees=90.0)(poses(), sway)
    where, _ = camera(Mount(offset=(0.0, 2.0, 0.0))(turned, sway))
    assert where == pytest.approx([3.4, 1.0, 2.5])  # left of who looks left is backwards


def test_quaternions_multiply_as_rotations_do():
    half = math.sqrt(0.5)
    yaw = torch.tensor([[half, 0.0, 0.0, half]], dtype=torch.float64)
    torch.testing.assert_close(
        product(yaw, yaw), torch.tensor([[0.0, 0.0, 0.0, 1.0]], dtype=torch.float64)
    )
    x = torch.tensor([1.0, 0.0, 0.0], dtype=torch.float64)
    assert rotate(yaw, x)[0].tolist() == pytest.approx([0.0, 1.0, 0.0])


def test_the_picture_is_that_of_a_camera_there():
    """Half a metre higher, the horizon stays and the near ground shrinks: as if the drone rose."""
    worlds = Worlds(1, num_shards=1)
    worlds.reset(torch.arange(1), [world_random_state(0, 0)])
    risen = worlds.poses(worlds.state)
    risen.position = risen.position + torch.tensor([0.0, 0.0, 0.5])
    sway = torch.ones(1, 1, dtype=torch.float64)
    mounted = Mount(offset=(0.0, 0.0, 0.5))(worlds.poses(worlds.state), sway)
    drawn = [
        worlds.renderer.render(worlds.policy_view, p)["rgb"].clone()
        for p in (risen, mounted, worlds.poses(worlds.state))
    ]
    worlds.close()
    assert torch.equal(drawn[0], drawn[1])
    assert not torch.equal(drawn[0], drawn[2])
