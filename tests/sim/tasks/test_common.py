"""Functions shared by tasks: hidden props, sides, classes of goals, positions in view."""

import math

import pytest
import torch

from drone_rl.config import CameraSettings, TaskSettings
from drone_rl.sim.tasks import CollectCubes, Goals
from drone_rl.sim.tasks.common import (
    HIDDEN_DEPTH,
    Side,
    interval_classes,
    number_classes,
    place_in_view,
    side_of,
)


def cubes_at(places):
    task = CollectCubes(TaskSettings(num_cubes=places.shape[1]))
    return task, task.start(places)


def test_absent_props_are_under_the_floor():
    places = torch.tensor([[[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]], dtype=torch.float64)
    task, state = cubes_at(places)
    state.collected[0, 1] = True
    expected = [[[1.0, 2.0, 3.0], [4.0, 5.0, 6.0 - HIDDEN_DEPTH]]]
    assert task.places(state).tolist() == expected


def test_only_the_next_prop_moves_left():
    places = torch.tensor([[[9.0, 0.0, 0.0], [10.0, 0.0, 0.0]]] * 2, dtype=torch.float64)
    task, state = cubes_at(places)
    state.passed[1, 0] = True
    moved = task.next_moved(state, torch.tensor([1.0, -2.0])).cubes
    assert moved[..., 1].tolist() == [[1.0, 0.0], [0.0, -2.0]]
    assert torch.equal(moved[..., [0, 2]], places[..., [0, 2]])
    assert not places[..., 1].any(), "the input is unchanged"
    assert task.next_moved(state, 3.0).cubes[..., 1].tolist() == [[3.0, 0.0], [0.0, 3.0]]


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
