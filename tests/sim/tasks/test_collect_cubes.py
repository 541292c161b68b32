"""Rules, scene, oracle, goals, replay and explanations of cube collection, computed by hand."""

import itertools
import math

import numpy as np
import pytest
import torch
from hypothesis import settings

from drone_rl.config import CameraSettings, TaskSettings
from drone_rl.sim.actions import DOWN, MOVES_3D, UP, Move
from drone_rl.sim.dynamics import BodyState, ComputerVision
from drone_rl.sim.tasks import FailureReplayTask
from drone_rl.sim.tasks.collect_cubes import (
    CollectCubes,
    CubeGoals,
    CubesEnd,
    Side,
    inflated,
)
from drone_rl.sim.worlds import Worlds
from drone_rl.utils.errors import InputError
from tests.fake_flight import FLIGHT, Floating

SETTINGS = TaskSettings()  # contact up to 1.65 m on each axis
ONE = CollectCubes(TaskSettings(num_cubes=1))


def at(*ys, settings=SETTINGS):
    """Return one environment with cubes at these y."""
    x = settings.first_distance + settings.spacing * torch.arange(len(ys))
    y, z = torch.tensor(ys).double(), torch.full((len(ys),), settings.altitude).double()
    return CollectCubes(settings).start(torch.stack([x, y, z], -1)[None])


def body(*place):
    """Return one drone at rest."""
    return BodyState.at_rest(torch.tensor([place], dtype=torch.float64))


def fly(state, x, y, settings=SETTINGS):
    return CollectCubes(settings).step(state, body(x, y, settings.altitude))


def move(task, state, action):
    """Step all environments in computer-vision mode."""
    moves = torch.tensor([action] * len(state))
    return CollectCubes(task).step(state, ComputerVision(task.step_length).step(state.body, moves))


def test_enumeration_values_are_those_of_files():
    assert [(a.name, a.value) for a in Move] == [("FORWARD", 0), ("LEFT", 1), ("RIGHT", 2)]
    assert [(s.name, s.value) for s in Side] == [("LEFT", 0), ("AHEAD", 1), ("RIGHT", 2)]
    ends = (
        *("RUNNING", "ALL_CUBES", "FRONT_BOUNDARY", "SIDE_BOUNDARY", "STEP_LIMIT"),
        "LOST_CONTROL",
    )
    assert [(e.name, e.value) for e in CubesEnd] == [(n, i) for i, n in enumerate(ends)]


def test_reward_is_one_per_collected_cube():
    state, reward = fly(at(1.0, 0.0, 0.0), 14.0, 0.0)
    assert reward.tolist() == [1.0]
    assert reward.dtype == torch.float64
    assert state.steps.tolist() == [1]
    assert state.reached.tolist() == [[True, False, False]]
    assert state.ahead.tolist() == [1]
    _, again = fly(state, 14.0, 1.0)
    assert again.tolist() == [0.0]


def beyond(value):
    """Return the next float64 away from zero."""
    return float(np.nextafter(value, 2 * value))


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_contact_distance_is_exact(axis, sign):
    """On each axis and from both sides, 1.65 m is a contact and the next float64 is none."""
    for distance, touches in ((1.65, True), (beyond(1.65), False)):
        cube = torch.zeros(1, 1, 3).double()
        cube[..., axis] = sign * distance
        state, reward = ONE.step(ONE.start(cube), body(0, 0, 0))
        assert state.reached.item() == touches
        assert reward.item() == float(touches)


def test_contact_needs_all_three_axes():
    corner = torch.tensor([[[1.6, -1.6, 1.6]]]).double()
    assert ONE.step(ONE.start(corner), body(0, 0, 0))[1] == 1
    for axis in range(3):
        aside = corner.clone()
        aside[..., axis] *= 1.1
        assert ONE.step(ONE.start(aside), body(0, 0, 0))[1] == 0


def test_a_touch_collects_what_stands_without_a_step():
    """Drones at (15, 0) and elsewhere: the first cube of the first environment, 1.65 m aside."""
    task, height = CollectCubes(TaskSettings(num_cubes=2)), SETTINGS.altitude
    state = task.start(torch.tensor([[[15.0, 1.65, height], [15.0, -1.0, height]]] * 2).double())
    state.present[0, 1] = False  # removed: it can't be touched
    steps = state.steps.tolist()
    task.touch(state, torch.tensor([[15.0, 0.0, height], [15.0, 9.0, height]]).double())
    assert state.reached.tolist() == [[True, False], [False, False]]
    assert state.steps.tolist() == steps and state.end_reason.tolist() == [0, 0]


def test_reward_is_two_for_two_simultaneous_cubes():
    cubes = torch.tensor([[[1.0, 0.0, 0.0], [1.5, 0.0, 0.0], [1.7, 0.0, 0.0]]]).double()
    state, reward = CollectCubes(SETTINGS).step(CollectCubes(SETTINGS).start(cubes), body(0, 0, 0))
    assert reward.tolist() == [2.0] and reward.dtype == torch.float64
    assert state.reached.tolist() == [[True, True, False]]


def test_cube_is_passed_strictly_behind_the_drone():
    for x, passed in ((15.0, False), (beyond(15.0), True)):
        state, _ = fly(at(5.0, 0.0, 0.0), x, 0.0)
        assert state.present.tolist() == [[not passed, True, True]]


def test_passed_cubes_are_removed_without_reward():
    state, _ = fly(at(5.0, 0.0, 0.0), 15.0, 0.0)
    assert state.present.tolist() == [[True, True, True]]  # a cube next to the drone is not passed
    state, reward = fly(state, 16.0, 0.0)
    assert reward.item() == 0.0
    assert state.present.tolist() == [[False, True, True]]
    _, reward = fly(state, 16.0, 5.0)
    assert reward.item() == 0.0  # no reward for a removed cube


def test_side_is_recorded_when_the_cube_becomes_next():
    state = at(5.0, -5.0, 0.5)
    assert state.sides.tolist() == [[Side.LEFT, -1, -1]]
    state, _ = fly(state, 14.0, 5.0)  # collects the first; the second is 10 m to the right
    assert state.sides.tolist() == [[Side.LEFT, Side.RIGHT, -1]]
    state, _ = fly(state, 25.0, 1.0)  # passes the second
    assert state.sides.tolist() == [[Side.LEFT, Side.RIGHT, Side.AHEAD]]
    assert state.noted.tolist() == [[5.0, -10.0, -0.5]]  # meters to the left at that time


def test_side_is_ahead_up_to_the_contact_distance():
    for y, side in ((1.65, Side.AHEAD), (beyond(1.65), Side.LEFT)):
        for sign in (1, -1):
            cubes = torch.tensor([[[15.0, sign * y, 0.0]]], dtype=torch.float64)
            mirrored = {Side.LEFT: Side.RIGHT, Side.AHEAD: Side.AHEAD}[side] if sign < 0 else side
            assert ONE.start(cubes).sides.tolist() == [[mirrored]]


def test_end_conditions_of_algorithm_3():
    state = at(0.0, 0.0, 0.0)
    assert fly(state, 44.0, 0.0)[0].end_reason.item() == CubesEnd.RUNNING
    assert fly(state, beyond(44.0), 0.0)[0].end_reason.item() == CubesEnd.FRONT_BOUNDARY
    assert fly(state, -100.0, 0.0)[0].end_reason.item() == CubesEnd.RUNNING
    for y in (26.0, -26.0):
        assert fly(state, 0.0, y)[0].end_reason.item() == CubesEnd.RUNNING
        assert fly(state, 0.0, beyond(y))[0].end_reason.item() == CubesEnd.SIDE_BOUNDARY
    for steps, reason in ((298, CubesEnd.RUNNING), (299, CubesEnd.STEP_LIMIT)):
        state.steps[:] = steps
        assert fly(state, 0.0, 0.0)[0].end_reason.item() == reason


@pytest.mark.parametrize("coinciding", list(itertools.product([False, True], repeat=4)))
def test_first_of_simultaneous_end_conditions_counts(coinciding):
    all_cubes, front, side, limit = coinciding
    state = at(0.0, 0.0, 0.0)
    state.reached[:] = all_cubes
    state.steps[:] = 299 if limit else 0
    ended, _ = fly(state, 45.0 if front else 0.0, 27.0 if side else 0.0)
    order = ("ALL_CUBES", "FRONT_BOUNDARY", "SIDE_BOUNDARY", "STEP_LIMIT")
    expected = next((n for n, holds in zip(order, coinciding, strict=True) if holds), "RUNNING")
    assert ended.end_reason.item() == CubesEnd[expected]


def test_lost_drone_ends_only_its_own_episode():
    cubes = torch.zeros(2, 3, 3).double()
    cubes[..., 0] = 50.0
    state = CollectCubes(SETTINGS).start(cubes)
    state.reached[:] = True
    body = Floating(FLIGHT, None).start(torch.zeros(2, 3).double())
    body.lost[1] = True
    ended, _ = CollectCubes(SETTINGS).step(state, body)
    assert ended.end_reason.tolist() == [CubesEnd.ALL_CUBES, CubesEnd.LOST_CONTROL]
    state.reached[:] = False
    body.position[:, 1] = 1000.0
    ended, _ = CollectCubes(SETTINGS).step(state, body)
    assert ended.end_reason.tolist() == [CubesEnd.SIDE_BOUNDARY, CubesEnd.LOST_CONTROL]


def test_samples_follow_the_random_stream_in_order():
    """Samples are lateral and vertical offsets of each cube in turn; published figures use them."""
    task = TaskSettings(vertical_bound=1.0, num_cubes=2)
    raw = np.random.RandomState(5).uniform(-1, 1, size=(2, 2))
    expected = [[15.0, 6 * raw[0, 0], 2.5 + raw[0, 1]], [24.0, 6 * raw[1, 0], 2.5 + raw[1, 1]]]
    assert CollectCubes(task).sample(np.random.RandomState(5)).tolist() == expected


QUICK = settings(max_examples=30, deadline=None)


NEAR = TaskSettings(num_cubes=3, first_distance=4.0, spacing=4.0, front_margin=3.0)


def flight(places, moves, task=NEAR):
    """Return the states and rewards of one environment over all moves."""
    state, rewards = at(*places, settings=task), []
    states = [state]
    for action in moves:
        state, reward = move(task, state, action)
        states.append(state)
        rewards.append(reward.item())
    return states, rewards


TALL = TaskSettings(vertical_bound=6.0, altitude=10.0)  # out of bounds beyond 7.65 m up or down


def test_drones_without_moves_up_and_down_are_refused_if_cubes_are_out_of_reach():
    with pytest.raises(InputError, match=r"vertical_bound=6.0 puts cubes .* or actions=moves_3d"):
        Worlds(1, TALL)
    CollectCubes(TALL).check_dynamics(ComputerVision(actions=MOVES_3D))
    CollectCubes(SETTINGS).check_dynamics(ComputerVision())


@pytest.mark.parametrize(
    ("z", "end"),
    [(17.6, CubesEnd.RUNNING), (17.7, CubesEnd.SIDE_BOUNDARY), (2.3, CubesEnd.SIDE_BOUNDARY)],
)
def test_a_drone_too_high_or_low_is_out_of_bounds(z, end):
    state, _ = CollectCubes(TALL).step(at(0.0, 0.0, 0.0, settings=TALL), body(1.0, 0.0, z))
    assert int(state.end_reason) == end


def test_height_is_unbounded_where_drones_need_not_climb():
    state, _ = CollectCubes(SETTINGS).step(at(0.0, 0.0, 0.0), body(1.0, 0.0, 500.0))
    assert int(state.end_reason) == CubesEnd.RUNNING


@pytest.mark.parametrize(
    ("offset", "action"),
    [
        ((10.0, 3.0, 5.0), Move.LEFT),  # sideways first
        ((10.0, 0.0, 5.0), UP),
        ((10.0, 0.0, -5.0), DOWN),
        ((10.0, 0.0, 0.5), Move.FORWARD),
    ],
)
def test_the_oracle_climbs_once_it_is_lined_up(offset, action):
    task, drone = CollectCubes(TALL), torch.tensor([[0.0, 0.0, 10.0]])
    cubes = (drone + torch.tensor([offset]))[:, None]
    assert task.oracle.actions is MOVES_3D
    assert int(task.line_up(drone, cubes, torch.tensor([[0]]))) == action
    assert int(task.line_up(drone, cubes, torch.tensor([[1]]))) == Move.FORWARD


TWO_CUBES = CollectCubes(TaskSettings(num_cubes=2, step_length=0.5, altitude=3.0))


def start_of_two():
    drawn = torch.tensor([[[15.0, 1.0, 3.0], [24.0, -2.0, 3.0]]], dtype=torch.float64)
    origin = torch.tensor([TWO_CUBES.origin], dtype=torch.float64)
    return TWO_CUBES.start(drawn, TWO_CUBES.make_dynamics().start(origin))


def test_info_matches_hand_computed_values():
    state = start_of_two()
    info = TWO_CUBES.info(state)
    assert info["cubes"].tolist() == [[0]] and info["next_cube"].tolist() == [[0]]
    assert info["side"].tolist() == [[1, -1]] and info["lateral"][0, 0] == 1.0
    state.reached[0, 0], state.present[0, 0] = True, False
    info = TWO_CUBES.info(state)
    assert info["cubes"].tolist() == [[1]] and info["next_cube"].tolist() == [[1]]


def test_distance_classes_follow_from_the_settings():
    assert CollectCubes(TaskSettings()).sideways_edges() == [1.65, 4.0, 6.0, 9.0]
    assert CollectCubes(TaskSettings(lateral_bound=3.0)).sideways_edges() == [1.65, 2.5, 3.0, 4.5]
    assert CollectCubes(TaskSettings(lateral_bound=0.5)).sideways_edges() == [1.65]


def test_goals_use_the_last_info():
    info = {
        "collected": torch.tensor([[True, False]]),
        "side": torch.tensor([[2, -1]]),
        "lateral": torch.tensor([[-3.0, torch.nan]]).double(),
        "cube_positions": torch.tensor([[[15.0, -3.0, 2.0], [24.0, 1.0, 3.0]]]),
        "drone": torch.tensor([[30.0, 0.0, 9.0]]),  # it has climbed from 2.5 m
    }
    task = CollectCubes(TaskSettings(num_cubes=2))
    goals = task.score(info)
    assert goals.reached.tolist() == [[True, False]] and goals.stratum.tolist() == [[2, -1]]
    assert goals.height.tolist() == [[-0.5, 0.5]] and goals.lateral[0, 0] == -3.0
    assert goals.world.tolist() == [[15.0, -3.0, 2.0, 24.0, 1.0, 3.0]]
    found = {(by, value): of.tolist() for by, value, of in task.classes(goals)}
    assert found["cube", "second"] == [[False, True]]
    assert found["side", "right"] == [[True, False]] and found["side", "left"] == [[False, False]]
    assert found["sideways", "1.65 to 4 m"] == [[True, False]]
    assert not any(by == "height" for by, _ in found)  # all cubes are level


F, L, R = Move.FORWARD, Move.LEFT, Move.RIGHT


def test_oracle_aligns_with_the_next_cube():
    """The tolerance is half the contact distance of 1.65 m."""
    drone = torch.tensor([[0.0, 1.0, 2.5]] * 4)
    cubes = torch.tensor([[[9.0, 1.8, 2.5], [18.0, 1.9, 2.5]]] * 4)
    cubes[3, 1, 1] = 0.1
    following = torch.tensor([[0], [1], [2], [1]])
    assert CollectCubes().line_up(drone, cubes, following).tolist() == [F, L, F, R]


def test_oracle_tolerance_is_at_least_half_a_step():
    settings = TaskSettings(cube_size=0.3, drone_size=1.7, step_length=1.0, altitude=2.5)
    drone, near = torch.zeros(1, 3), torch.tensor([[[9.0, 0.49, 0.0]]])
    first = torch.tensor([[0]])
    assert CollectCubes(settings).line_up(drone, near, first).tolist() == [F]
    assert CollectCubes(settings).line_up(drone, near + 0.03, first).tolist() == [L]


def test_height_classes_need_varying_heights():
    none = torch.zeros(1, 1)
    cube = CubeGoals(none > 0, none.long(), none, none.double(), none.double())
    level = {by for by, *_ in CollectCubes(TaskSettings(num_cubes=1)).classes(cube)}
    tall = CollectCubes(TaskSettings(num_cubes=1, vertical_bound=0.6)).classes(cube)
    assert level == {"cube", "side", "sideways"}
    assert {by for by, *_ in tall} == level | {"height"}


REPLAYED = TaskSettings(num_cubes=2)


BOXES = np.array([[[1.0, 2.0], [-6.0, -4.0]], [[3.0, 3.0], [0.0, 0.5]]])


class FixedSamples:
    """A random stream with fixed samples."""

    def __init__(self, *draws):
        self.draws = list(draws)

    def uniform(self, low=0.0, high=1.0, size=None):
        drawn = np.array([self.draws.pop(0) for _ in range(int(np.prod(size)))])
        return low + drawn.reshape(size) * (high - low)


ANYWHERE = (0.5, 0.5, 0.75, 0.5)
"""Samples of y and z of two cubes: y is 0 and 3 m."""


def test_placements_match_hand_computed_ones():
    task = FailureReplayTask(REPLAYED, BOXES, 0.5)
    left = [
        task.sample(FixedSamples(*ANYWHERE, chance, which, 0.25, 0.5)).tolist()
        for chance, which in ((0.6, 0.0), (0.4, 0.49), (0.4, 0.5))
    ]
    assert left == [
        [[15.0, 0.0, 2.5], [24.0, 3.0, 2.5]],
        [[15.0, 1.25, 2.5], [24.0, -5.0, 2.5]],
        [[15.0, 3.0, 2.5], [24.0, 0.25, 2.5]],
    ]


def test_inflated_boxes_stay_within_the_placements():
    reached = inflated(BOXES, 0.5, 6.0)
    assert reached.tolist() == [[[0.5, 2.5], [-6.0, -3.5]], [[2.5, 3.5], [-0.5, 1.0]]]


def test_elsewhere_places_cubes_at_valid_positions():
    """Positions are in view, from the camera to the distance of the first cube."""
    task, camera = TaskSettings(vertical_bound=1.0, altitude=4.0), CameraSettings()
    state = CollectCubes(task).start(torch.zeros(400, 3, 3, dtype=torch.float64))
    state.drone[:] = torch.tensor([5.0, -2.0, 4.0])
    state.reached[:, 0] = True
    moved = CollectCubes(task).edits.elsewhere(state, camera, torch.Generator().manual_seed(0))
    assert moved.present.all() and state.reached[:, 0].all()
    assert (moved.places[..., 0].diff(dim=1) >= 0).all()  # as in every state, the nearest first
    ahead, aside, up = (moved.places - state.drone[:, None]).flatten(0, 1).unbind(-1)
    nearest, edge = 1.65 + 2.5, math.tan(math.radians(camera.horizontal_fov / 2))
    assert nearest <= ahead.min() < nearest + 0.5 and 14.5 < ahead.max() <= 15.0
    slope = aside / ahead
    assert -edge <= slope.min() < -0.95 * edge and 0.95 * edge < slope.max() <= edge
    drawn = torch.stack([ahead, slope, up])[:, slope.abs() < 0.5 * edge]
    assert (torch.corrcoef(drawn) - torch.eye(3)).abs().max() < 0.2  # independent samples
    assert abs(slope.mean()) < 0.2 * edge and 11.5 < aside.abs().max() <= 12.0 + 1e-9
    assert -1.0 <= up.min() < -0.9 and 0.9 < up.max() <= 1.0 and abs(up.mean()) < 0.15


THREE_CUBES = CollectCubes()


def test_needed_action_and_stratum_follow_from_the_offset():
    """Flying straight ahead touches cubes within 1.65 m."""
    aside = torch.tensor([3.0, 1.6, -1.6, -3.0])
    offset = torch.stack([torch.full((4,), 9.0), aside, torch.zeros(4)], -1)
    assert THREE_CUBES.edits.needed(offset).tolist() == [
        Move.LEFT,
        Move.FORWARD,
        Move.FORWARD,
        Move.RIGHT,
    ]
    assert THREE_CUBES.edits.stratum_at(offset).tolist() == [
        Side.LEFT,
        Side.AHEAD,
        Side.AHEAD,
        Side.RIGHT,
    ]
