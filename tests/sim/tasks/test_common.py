"""Functions shared by tasks: sides, classes of goals, positions in view."""

import math

import pytest
import torch

from drone_rl.config import CameraSettings
from drone_rl.sim.tasks import Goals
from drone_rl.sim.tasks.common import (
    Side,
    interval_classes,
    number_classes,
    place_in_view,
    side_of,
)


def test_sides_have_a_tolerance():
    lateral = torch.tensor([1.1, 1.0, 0.0, -1.0, -1.1])
    assert side_of(lateral, 1.0).tolist() == [Side.LEFT, *[Side.AHEAD] * 3, Side.RIGHT]


def goals(shape=(2, 3)):
    reached = torch.zeros(shape, dtype=torch.bool)
    return Goals(reached, torch.zeros(shape, dtype=torch.int64), torch.zeros(shape))


def test_ordinal_classes_have_one_class_per_goal():
    classes = list(number_classes("cube", goals()))
    assert [(name, label) for name, label, _ in classes] == [
        ("cube", "first"), ("cube", "second"), ("cube", "third"),
    ]  # fmt: skip
    assert classes[1][2].tolist() == [[False, True, False]] * 2


def test_classes_between_edges_include_the_upper_one():
    values = torch.tensor([0.0, 0.5, 1.0, 2.0, 3.0, math.nan])
    classes = list(interval_classes("height", values, [0.0, 1.0, 2.0]))
    assert [label for _, label, _ in classes] == ["0 to 1 m", "1 to 2 m", "more than 2 m"]
    chosen = [values[which].tolist() for *_, which in classes]
    assert chosen == [[0.5, 1.0], [2.0], [3.0]]


@pytest.mark.parametrize(
    ("draw", "ahead", "left"),
    [
        ((0.0, 0.5), 2.0, 0.0),
        ((1.0, 0.5), 10.0, 0.0),
        ((1.0, 0.75), 6.0, 3.0),
        ((0.0, 0.0), 2.0, -2.0),
    ],
)
def test_positions_are_in_view(draw, ahead, left):
    camera = CameraSettings(horizontal_fov=90.0)  # the slope at the border is 1
    found = place_in_view(torch.tensor([draw], dtype=torch.float64), camera, 2.0, 10.0, 3.0)
    torch.testing.assert_close(found, torch.tensor([[ahead, left]], dtype=torch.float64))
