"""Hand-computed placements within boxes of failures."""

import numpy as np
import pytest
import torch

from drone_rl.config import TaskSettings
from drone_rl.sim.tasks import CollectCubes, FailureReplayTask
from drone_rl.sim.tasks.collect_cubes import inflated
from drone_rl.utils.errors import InputError
from drone_rl.utils.seeding import get_state, set_state, world_random_state

TASK = TaskSettings(num_cubes=2)
BOXES = np.array([[[1.0, 2.0], [-6.0, -4.0]], [[3.0, 3.0], [0.0, 0.5]]])


class Given:
    """A random stream with fixed samples."""

    def __init__(self, *draws):
        self.draws = list(draws)

    def uniform(self, low=0.0, high=1.0, size=None):
        drawn = np.array([self.draws.pop(0) for _ in range(int(np.prod(size)))])
        return low + drawn.reshape(size) * (high - low)


ANYWHERE = (0.5, 0.5, 0.75, 0.5)
"""Samples of y and z of two cubes: y is 0 and 3 m."""


def test_placements_match_hand_computed_ones():
    task = FailureReplayTask(TASK, BOXES, 0.5)
    left = [
        task.sample(Given(*ANYWHERE, chance, which, 0.25, 0.5)).tolist()
        for chance, which in ((0.6, 0.0), (0.4, 0.49), (0.4, 0.5))
    ]
    assert left == [
        [[15.0, 0.0, 2.5], [24.0, 3.0, 2.5]],
        [[15.0, 1.25, 2.5], [24.0, -5.0, 2.5]],
        [[15.0, 3.0, 2.5], [24.0, 0.25, 2.5]],
    ]


def test_extreme_fractions_replay_none_or_all():
    usual, world = CollectCubes(TASK), world_random_state(3, 0)
    assert torch.equal(
        FailureReplayTask(TASK, BOXES, 0.0).sample(world_random_state(3, 0)), usual.sample(world)
    )
    always = FailureReplayTask(TASK, BOXES, 1.0)
    y = np.stack([always.sample(world)[:, 1].numpy() for _ in range(200)])
    is_inside = ((y[:, None] >= BOXES[..., 0]) & (y[:, None] <= BOXES[..., 1])).all(-1)
    assert is_inside.any(-1).all()
    assert 60 < is_inside[:, 0].sum() < 140  # boxes are equally frequent, regardless of size


def test_saved_stream_resumes_placements():
    task, world, other = (
        FailureReplayTask(TASK, BOXES, 0.5),
        world_random_state(1, 2),
        world_random_state(9, 9),
    )
    task.sample(world)
    set_state(other, get_state(world))
    for _ in range(20):
        assert torch.equal(task.sample(world), task.sample(other))


def test_inflated_boxes_stay_within_the_placements():
    reached = inflated(BOXES, 0.5, 6.0)
    assert reached.tolist() == [[[0.5, 2.5], [-6.0, -3.5]], [[2.5, 3.5], [-0.5, 1.0]]]


@pytest.mark.parametrize(
    ("boxes", "message"),
    [
        (np.empty((0, 2, 2)), r"boxes has shape \(0, 2, 2\); give shape \(N, 2, 2\), N at least 1"),
        (np.zeros((1, 3, 2)), r"boxes has shape \(1, 3, 2\)"),
        (np.full((1, 2, 2), 6.5), r"boxes extend to 6.5 m; give bounds within 6 m"),
        (
            np.array([[[1.0, 0.0], [0.0, 1.0]]]),
            r"lower bound above its upper one; give \(lower, upper\)",
        ),
    ],
)
def test_invalid_boxes_raise(boxes, message):
    with pytest.raises(InputError, match=message):
        FailureReplayTask(TASK, boxes, 0.5)
