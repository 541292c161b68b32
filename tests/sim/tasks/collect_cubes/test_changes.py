"""Worlds that were never drawn, with hand-computed places."""

import math

import pytest
import torch

from drone_rl.config import CameraSettings, TaskSettings
from drone_rl.sim.dynamics import BodyState
from drone_rl.sim.tasks.collect_cubes import changes, rules

TASK = TaskSettings(num_cubes=2)


@pytest.fixture
def state():
    """Two worlds of two cubes; in the second none is left."""
    cubes = torch.tensor([[[15.0, 1.0, 2.5], [24.0, -2.0, 2.5]]] * 2, dtype=torch.float64)
    state = rules.start(TASK, cubes)
    state.drone[:, 0], state.drone[:, 1] = 5.0, 4.0
    state.collected[1, 0], state.passed[1, 1] = True, True
    return state


def test_the_next_cube_is_seen_from_the_drone(state):
    assert changes.next_offset(state)[0].tolist() == [10.0, -3.0, 0.0]
    assert changes.next_offset(state)[1].isnan().all()
    state.collected[0, 0] = True
    assert changes.next_offset(state)[0].tolist() == [19.0, -6.0, 0.0]
    assert changes.is_next(state).tolist() == [[False, True], [False, False]]


def test_one_cube_stands_where_it_is_asked_for_seen_from_each_drone():
    body = BodyState.at_rest(torch.tensor([[0.0, 0, 2.5], [7.0, -1.0, 3.0]], dtype=torch.float64))
    away = torch.tensor([[9.0, 2.0, 0.5], [9.0, 2.0, 0.5]])
    found = changes.one_cube(TASK, body, away)
    assert found.cubes[:, 0].tolist() == [[9.0, 2.0, 3.0], [16.0, 1.0, 3.5]]
    assert found.present.tolist() == [[True, False]] * 2
    assert found.side.tolist()[0][0] == rules.Side.LEFT and torch.equal(found.drone, body.position)


def test_the_next_cube_alone_is_moved_or_taken_away(state):
    moved = changes.next_moved(state, torch.tensor([2.0, 2.0]))
    assert moved.cubes[0, :, 1].tolist() == [3.0, -2.0]
    assert torch.equal(moved.cubes[1], state.cubes[1])  # nothing is left to be moved
    assert changes.next_moved(state, -1.5).cubes[0, 0, 1] == -0.5
    gone = changes.without_next(state)
    assert gone.present.tolist() == [[False, True], [False, False]]
    assert changes.without_cubes(state).present.any() == torch.tensor(False)
    assert state.cubes[0, 0, 1] == 1.0 and state.present[0].all()  # the given one is as it was


def test_cubes_elsewhere_stand_where_cubes_can_stand():
    """In view, from where one just fits before the camera to where the first one stands."""
    task, camera = TaskSettings(vertical_bound=1.0, altitude=4.0), CameraSettings()
    state = rules.start(task, torch.zeros(400, 3, 3, dtype=torch.float64))
    state.drone[:] = torch.tensor([5.0, -2.0, 4.0])
    state.collected[:, 0] = True
    moved = changes.elsewhere(task, state, camera, torch.Generator().manual_seed(0))
    assert moved.present.all() and state.collected[:, 0].all()
    ahead, aside, up = (moved.cubes - state.drone[:, None]).flatten(0, 1).unbind(-1)
    nearest, edge = 1.65 + 2.5, math.tan(math.radians(camera.horizontal_fov / 2))
    assert nearest <= ahead.min() < nearest + 0.5 and 14.5 < ahead.max() <= 15.0
    slope = aside / ahead
    assert -edge <= slope.min() < -0.95 * edge and 0.95 * edge < slope.max() <= edge
    drawn = torch.stack([ahead, slope, up])[:, slope.abs() < 0.5 * edge]
    assert (torch.corrcoef(drawn) - torch.eye(3)).abs().max() < 0.2  # independent of one another
    assert abs(slope.mean()) < 0.2 * edge and 11.5 < aside.abs().max() <= 12.0 + 1e-9
    assert -1.0 <= up.min() < -0.9 and 0.9 < up.max() <= 1.0 and abs(up.mean()) < 0.15


def test_places_reach_as_far_as_cubes_stand():
    def ends(**settings):
        height, *axes = changes.grid(TaskSettings(**settings), 3, 5)
        return [height.tolist(), *([axis[0].item(), axis[-1].item()] for axis in axes)]

    near = pytest.approx([1.65 + 0.5, 15.0])  # half a step from touching
    assert ends() == [[0.0], near, [12.0, -12.0]]
    near = pytest.approx([1.65 + 0.2, 9.0])
    task = {"step_length": 0.4, "first_distance": 9.0, "vertical_bound": 0.5}
    assert ends(lateral_bound=4.0, **task) == [[-0.5, 0.0, 0.5], near, [8.0, -8.0]]
    assert ends(lateral_bound=0.0)[2] == pytest.approx([3.3, -3.3])  # twice the reach of a touch
