from contextlib import closing

import numpy as np
import pytest
import torch

from drone_rl.config import TaskSettings
from drone_rl.envs import DroneEnv, GrayPixels, StandardizePixels, with_transforms
from drone_rl.explanations.rollouts import collect, render_frames, select_frames
from drone_rl.explanations.scenes import Scenes
from drone_rl.policies import ExternalNetwork, make_actor
from drone_rl.sim.actions import MOVES
from drone_rl.sim.tasks import CollectCubes


@pytest.fixture
def flights(world):
    return collect(*world[:2], num_episodes=6, num_frames=1)


def test_flights_are_whole_and_their_steps_belong_together(flights):
    assert np.unique(flights.episode).tolist() == list(range(6))  # four worlds, then two of them
    ends = np.append(flights.episode[1:] != flights.episode[:-1], True)
    assert (flights.end_reason[ends] != 0).all() and (flights.end_reason[~ends] == 0).all()
    same = ~ends[:-1]
    step = np.where(flights.actions[:-1] == 0, 1.0, 0.0)  # forward moves the drone 1 m in x
    moved = flights.drone[1:, 0] - flights.drone[:-1, 0]
    np.testing.assert_allclose(moved[same], step[same])
    assert (flights.step[1:][same] == flights.step[:-1][same] + 1).all()
    assert flights.step[np.append(True, ends[:-1])].sum() == 0


def test_as_many_frames_are_flown_as_are_asked_for(world):
    assert len(collect(*world[:2], num_episodes=1, num_frames=400)) >= 400


def test_every_episode_gives_as_many_frames_evenly_spaced():
    episode = np.repeat([0, 1, 2], [100, 4, 10])
    rows = select_frames(episode, 24)
    # 8 each; the one of 4 has no more, so that its other 4 go to the rest: 10 and 10
    assert np.bincount(episode[rows]).tolist() == [10, 4, 10]
    assert rows[:10].tolist() == [5, 15, 25, 35, 45, 55, 65, 75, 85, 95]
    assert rows[10:].tolist() == list(range(100, 114))


def test_all_frames_are_taken_where_there_are_no_more():
    episode = np.repeat([0, 1], [3, 2])
    assert select_frames(episode, 9).tolist() == [0, 1, 2, 3, 4]
    assert len(select_frames(episode, 3)) == 3


def test_drawn_frames_are_those_that_were_asked_for(flights, world):
    rows = np.array([3, 17])
    seen = render_frames(flights, rows, Scenes(world[0]), world[2], ("relu1",))
    np.testing.assert_array_equal(seen.step, flights.step[rows])
    np.testing.assert_array_equal(seen.observations, flights.observations[rows])
    assert len(seen.features["relu1"]) == len(seen.frames) == 2
    np.testing.assert_allclose(seen.probabilities.sum(-1), 1, atol=1e-6)


def test_a_cube_missed_by_the_last_step_is_an_event():
    task = TaskSettings(num_cubes=1, first_distance=10.0, lateral_bound=8.0, front_margin=0.5)
    env = with_transforms(DroneEnv(20, seed=0, task=task), [GrayPixels(), StandardizePixels()])
    with closing(env):
        network = ExternalNetwork(always_forward, (1, 25, 64), MOVES)
        flown = collect(env, make_actor(network, env.action_spec), num_episodes=20)
    ends = np.append(flown.episode[1:] != flown.episode[:-1], True)
    is_reached = flown.end_reason[ends] == CollectCubes.success_end
    assert 0 < is_reached.sum() < 20
    np.testing.assert_array_equal(flown.event[ends], np.where(is_reached, 1, -1))


def always_forward(observations):
    return torch.tensor([100.0, 0.0, 0.0]).repeat(len(observations), 1)
