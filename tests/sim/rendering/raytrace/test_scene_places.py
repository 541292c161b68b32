"""Frames as encoded for the kernels."""

import dataclasses

import pytest
import torch

from drone_rl.sim.rendering.appearance import Distractors
from drone_rl.sim.rendering.devices import start_warp
from drone_rl.sim.rendering.raytrace.scene import PoseBuffers
from drone_rl.sim.rendering.renderer import Poses


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


def test_pose_buffers_are_reused_for_fewer_environments():
    places = PoseBuffers(torch.device("cpu"))
    assert places.write(some(4)) is places.write(some(3))
    assert places.write(some(3)) is not places.write(some(5))


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
