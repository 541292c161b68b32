"""Hand-computed states of cube collection for explanations."""

import math

import pytest
import torch

from drone_rl.config import CameraSettings, TaskSettings
from drone_rl.sim.actions import Move
from drone_rl.sim.dynamics import BodyState
from drone_rl.sim.tasks.collect_cubes import CollectCubes, Side

TWO = TaskSettings(num_cubes=2)


@pytest.fixture
def state():
    """Return two environments with two cubes; in the second none is left."""
    cubes = torch.tensor([[[15.0, 1.0, 2.5], [24.0, -2.0, 2.5]]] * 2, dtype=torch.float64)
    state = CollectCubes(TWO).start(cubes)
    state.drone[:, 0], state.drone[:, 1] = 5.0, 4.0
    state.collected[1, 0], state.passed[1, 1] = True, True
    return state


def test_next_offset_is_relative_to_the_drone(state):
    assert CollectCubes(TWO).next_offset(state)[0].tolist() == [10.0, -3.0, 0.0]
    assert CollectCubes(TWO).next_offset(state)[1].isnan().all()
    state.collected[0, 0] = True
    assert CollectCubes(TWO).next_offset(state)[0].tolist() == [19.0, -6.0, 0.0]
    assert CollectCubes(TWO)._is_next(state).tolist() == [[False, True], [False, False]]


def test_one_target_is_placed_relative_to_each_drone():
    body = BodyState.at_rest(torch.tensor([[0.0, 0, 2.5], [7.0, -1.0, 3.0]], dtype=torch.float64))
    away = torch.tensor([[9.0, 2.0, 0.5], [9.0, 2.0, 0.5]])
    found = CollectCubes(TWO).one_target(body, away)
    assert found.cubes[:, 0].tolist() == [[9.0, 2.0, 3.0], [16.0, 1.0, 3.5]]
    assert found.present.tolist() == [[True, False]] * 2
    assert found.side.tolist()[0][0] == Side.LEFT and torch.equal(found.drone, body.position)


def test_only_the_next_cube_is_moved_or_removed(state):
    moved = CollectCubes(TWO).next_moved(state, torch.tensor([2.0, 2.0]))
    assert moved.cubes[0, :, 1].tolist() == [3.0, -2.0]
    assert torch.equal(moved.cubes[1], state.cubes[1])  # no cube is left
    assert CollectCubes(TWO).next_moved(state, -1.5).cubes[0, 0, 1] == -0.5
    gone = CollectCubes(TWO).without_next(state)
    assert gone.present.tolist() == [[False, True], [False, False]]
    assert CollectCubes(TWO).without_targets(state).present.any() == torch.tensor(False)
    assert state.cubes[0, 0, 1] == 1.0 and state.present[0].all()  # the input is unchanged


def test_elsewhere_places_cubes_at_valid_positions():
    """Positions are in view, from the camera to the distance of the first cube."""
    task, camera = TaskSettings(vertical_bound=1.0, altitude=4.0), CameraSettings()
    state = CollectCubes(task).start(torch.zeros(400, 3, 3, dtype=torch.float64))
    state.drone[:] = torch.tensor([5.0, -2.0, 4.0])
    state.collected[:, 0] = True
    moved = CollectCubes(task).elsewhere(state, camera, torch.Generator().manual_seed(0))
    assert moved.present.all() and state.collected[:, 0].all()
    assert (moved.cubes[..., 0].diff(dim=1) >= 0).all()  # as in every state, the nearest first
    ahead, aside, up = (moved.cubes - state.drone[:, None]).flatten(0, 1).unbind(-1)
    nearest, edge = 1.65 + 2.5, math.tan(math.radians(camera.horizontal_fov / 2))
    assert nearest <= ahead.min() < nearest + 0.5 and 14.5 < ahead.max() <= 15.0
    slope = aside / ahead
    assert -edge <= slope.min() < -0.95 * edge and 0.95 * edge < slope.max() <= edge
    drawn = torch.stack([ahead, slope, up])[:, slope.abs() < 0.5 * edge]
    assert (torch.corrcoef(drawn) - torch.eye(3)).abs().max() < 0.2  # independent samples
    assert abs(slope.mean()) < 0.2 * edge and 11.5 < aside.abs().max() <= 12.0 + 1e-9
    assert -1.0 <= up.min() < -0.9 and 0.9 < up.max() <= 1.0 and abs(up.mean()) < 0.15


def test_grid_covers_the_range_of_cubes():
    def ends(**settings):
        height, *axes = CollectCubes(TaskSettings(**settings)).grid(3, 5)
        return [height.tolist(), *([axis[0].item(), axis[-1].item()] for axis in axes)]

    near = pytest.approx([1.65 + 0.5, 15.0])  # half a step before contact
    assert ends() == [[0.0], near, [12.0, -12.0]]
    near = pytest.approx([1.65 + 0.2, 9.0])
    task = {"step_length": 0.4, "first_distance": 9.0, "vertical_bound": 0.5}
    assert ends(lateral_bound=4.0, **task) == [[-0.5, 0.0, 0.5], near, [8.0, -8.0]]
    assert ends(lateral_bound=0.0)[2] == pytest.approx([3.3, -3.3])  # twice the contact distance


TASK = CollectCubes()


def test_passed_and_collected_cubes_are_absent():
    """The first is collected and the second passed, so the third is next."""
    info = {
        "next_cube": torch.tensor([[2], [0]]),
        "collected": torch.tensor([[True, False, False], [False] * 3]),
        "cube_positions": torch.arange(18.0).view(2, 3, 3),
    }
    kept = TASK.remember(info)
    assert kept["present"].tolist() == [[False, False, True], [True] * 3]
    assert kept["next_target"].tolist() == [2, 0]
    body = BodyState.at_rest(torch.zeros(2, 3, dtype=torch.float64))
    state = TASK.recall({**kept, "step": torch.tensor([7, 0])}, body)
    assert state.passed.tolist() == [[False, True, False], [False] * 3]
    assert state.next_cube.tolist() == [2, 0] and state.steps.tolist() == [7, 0]
    assert state.cubes.dtype == torch.float64 and not state.end_reason.any()


def test_needed_action_and_stratum_follow_from_the_offset():
    """Flying straight ahead touches cubes within 1.65 m."""
    aside = torch.tensor([3.0, 1.6, -1.6, -3.0])
    offset = torch.stack([torch.full((4,), 9.0), aside, torch.zeros(4)], -1)
    assert TASK.needed(offset).tolist() == [Move.LEFT, Move.FORWARD, Move.FORWARD, Move.RIGHT]
    assert TASK.stratum_at(offset).tolist() == [Side.LEFT, Side.AHEAD, Side.AHEAD, Side.RIGHT]


def test_is_behind_and_is_reached_use_each_environments_target():
    body = BodyState.at_rest(torch.tensor([[20.0, 0.0, 2.5]] * 2, dtype=torch.float64))
    state = TASK.start(torch.tensor([[[15.0, 0, 2.5], [24.0, 0, 2.5], [33.0, 0, 2.5]]] * 2), body)
    state.collected[1, 1] = True
    target = torch.tensor([0, 1])
    assert TASK.is_behind(state, target).tolist() == [True, False]
    assert TASK.is_reached(state, target).tolist() == [False, True]
