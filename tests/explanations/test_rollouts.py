"""Recorded rollouts, and rollouts from given states."""

from contextlib import closing

import numpy as np
import pytest
import torch
from torch import nn
from torchrl.envs import CatFrames

from drone_rl.config import DynamicsSettings, TaskSettings
from drone_rl.envs import DroneEnv, GrayPixels, StandardizePixels
from drone_rl.explanations.rollouts import collect, run_to_end, select_frames, spread_frames
from drone_rl.explanations.scenes import Region, Scenes, place_target
from drone_rl.policies import ExternalNetwork, ImageNetwork, make_actor
from drone_rl.sim.actions import MOVES, Move
from drone_rl.sim.dynamics import FlightState
from drone_rl.sim.tasks import CollectCubes
from drone_rl.sim.tasks.collect_cubes import CubesEnd


def test_rendered_frames_give_the_observations(dataset, scenes):
    again = scenes.transform(torch.from_numpy(dataset.frames))
    np.testing.assert_allclose(again.numpy(), dataset.observations, atol=1e-6)


def test_the_file_holds_every_step_of_the_flights(dataset, world, tmp_path):
    flights = collect(*world[:2], num_episodes=4)
    dataset.save(tmp_path / "data.npz", flights)
    with np.load(tmp_path / "data.npz") as file:
        np.testing.assert_array_equal(file["flights/actions"], flights.actions)
        assert {"frames", "features/relu1", "flights/state/places"} < set(file.files)


def test_offset_is_seen_from_the_drone(dataset, scenes):
    t = int(np.flatnonzero(dataset.next_target == 0)[0])
    expected = dataset.arrays["state/places"][t, 0, :2] - dataset.drone[t, :2]
    np.testing.assert_allclose(dataset.offset(scenes.worlds)[t], expected)
    near = np.flatnonzero((dataset.next_target == 0) & (dataset.step < 5))
    assert (dataset.regions == Region.NEXT_TARGET).any((1, 2))[near].all()


def test_without_a_next_cube_there_is_no_offset(dataset, scenes):
    dataset.arrays["state/ahead"][:] = -1
    assert np.isnan(dataset.offset(scenes.worlds)).all()


def test_recorded_states_go_on_as_the_episodes_did(world):
    """Also a drone in flight: its velocity, rotors and controller are part of the state."""
    env = DroneEnv(2, dynamics=DynamicsSettings(mode="simple_flight"), transforms=[GrayPixels()])
    flights = collect(env, world[1], num_episodes=2)
    state, t = flights.state(env.worlds), 20  # of the first episode
    assert isinstance(state.body, FlightState) and state.body.velocity[t].norm() > 1.0
    action = flights.tensor("actions")[t : t + 1]
    after, _ = env.worlds.advance(state[torch.tensor([t])], action)
    env.close()
    assert torch.equal(after.body.numbers[0], state.body.numbers[t + 1])


def test_offset_follows_the_heading_of_a_turned_drone(dataset, scenes):
    t = int(np.flatnonzero(dataset.next_target == 0)[0])
    x, y = (dataset.arrays["state/places"][t, 0] - dataset.drone[t])[:2]
    dataset.arrays["state/body/attitude"][t] = [0.5**0.5, 0.0, 0.0, 0.5**0.5]  # it looks left
    np.testing.assert_allclose(dataset.offset(scenes.worlds)[t], (y, -x), atol=1e-5)


@pytest.fixture
def flights(world):
    return collect(*world[:2], num_episodes=6, num_frames=1)


def test_episodes_are_complete(flights):
    assert np.unique(flights.episode).tolist() == list(range(6))  # four worlds, then two of them
    ends = np.append(flights.episode[1:] != flights.episode[:-1], True)
    assert (flights.end_reason[ends] != 0).all() and (flights.end_reason[~ends] == 0).all()
    same = ~ends[:-1]
    step = np.where(flights.actions[:-1] == 0, 1.0, 0.0)  # forward moves the drone 1 m in x
    moved = flights.drone[1:, 0] - flights.drone[:-1, 0]
    np.testing.assert_allclose(moved[same], step[same])
    assert (flights.step[1:][same] == flights.step[:-1][same] + 1).all()
    assert flights.step[np.append(True, ends[:-1])].sum() == 0


def test_frames_are_spread_over_episodes():
    episode = np.repeat([0, 1, 2], [100, 4, 10])
    rows = select_frames(episode, 24)
    # 8 each; the one of 4 has no more, so that its other 4 go to the rest: 10 and 10
    assert np.bincount(episode[rows]).tolist() == [10, 4, 10]
    assert rows[:10].tolist() == [5, 15, 25, 35, 45, 55, 65, 75, 85, 95]
    assert rows[10:].tolist() == list(range(100, 114))


def test_frames_are_spread_over_each_episode():
    episode = np.array([3] * 9 + [5] * 2 + [8])
    assert spread_frames(episode, 3).tolist() == [1, 4, 7, 9, 10, 11]
    assert spread_frames(episode, 1).tolist() == [4, 10, 11]
    assert spread_frames(np.zeros(0), 3).tolist() == []


def test_a_cube_missed_by_the_last_step_is_an_event():
    task = TaskSettings(num_cubes=1, first_distance=10.0, lateral_bound=8.0, front_margin=0.5)
    env = DroneEnv(20, seed=0, task=task, transforms=[GrayPixels(), StandardizePixels()])
    with closing(env):
        network = ExternalNetwork(always_forward, (1, 25, 64), MOVES)
        flown = collect(env, make_actor(network, env.action_spec), num_episodes=20)
    ends = np.append(flown.episode[1:] != flown.episode[:-1], True)
    is_reached = flown.end_reason[ends] == CollectCubes.success_end
    assert 0 < is_reached.sum() < 20
    np.testing.assert_array_equal(flown.event[ends], np.where(is_reached, 1, -1))


def always_forward(observations):
    return torch.tensor([100.0, 0.0, 0.0]).repeat(len(observations), 1)


F, L, R = Move.FORWARD, Move.LEFT, Move.RIGHT


class Always(ImageNetwork):
    """Takes given actions one after the other, the last of them for ever; the same everywhere."""

    def __init__(self, *actions):
        super().__init__()
        self.moves, self.seen = list(actions), []

    def forward(self, pictures):
        self.seen.append(pictures)
        action = self.moves[min(len(self.seen), len(self.moves)) - 1]
        return 9.0 * nn.functional.one_hot(torch.full((len(pictures),), int(action)), 3).float()


@pytest.fixture
def two_scenes(make_pipeline):
    return Scenes(make_pipeline(num_envs=2)[0])


def test_flying_forward_collects_what_it_touches(two_scenes):
    reach = two_scenes.worlds.task.settings.touch_distance  # 1.65 m
    starts = place_target(
        two_scenes, torch.tensor([5.0, 5.0, 5.0]), torch.tensor([0, reach, reach + 0.1])
    )
    network = Always(F)
    ends = run_to_end(two_scenes, network, starts)
    assert ends.reached[:, 0].tolist() == [True, True, False]
    assert ends.steps.tolist() == [4, 4, 6]  # touches at 3.35 m, and has passed at 6 m
    assert [len(seen) for seen in network.seen] == [3, 3, 3, 3, 1, 1]  # what is settled rests
    assert starts.steps.tolist() == [0, 0, 0]  # where they started is left as it was


def test_a_loop_ends_the_episode(two_scenes):
    network = Always(F, L, R, F)
    ends = run_to_end(
        two_scenes, network, place_target(two_scenes, torch.tensor([9.0]), torch.tensor([0.0]))
    )
    assert ends.end_reason.tolist() == [CubesEnd.STEP_LIMIT] and not ends.reached.any()
    assert len(network.seen) == 3


def test_turning_back_after_a_cube_is_no_loop(two_scenes):
    starts = place_target(two_scenes, torch.tensor([1.0]), torch.tensor([2.0]))
    starts.present[:, 1] = True  # a second cube, 9 m on
    starts.places[:, 1, :2] = torch.tensor([10.0, 0.0])
    ends = run_to_end(two_scenes, Always(L, R, F), starts)
    assert ends.reached[0, :2].tolist() == [True, True]


def test_a_policy_with_memory_gets_earlier_frames():
    stack = CatFrames(N=2, dim=-3, in_keys=["pixels"])
    task = TaskSettings(num_cubes=1, step_limit=20)
    env = DroneEnv(1, task, transforms=[GrayPixels(), stack])
    two_scenes, network = Scenes(env), Always(F, L, R, F)
    starts = place_target(two_scenes, torch.tensor([9.0]), torch.tensor([0.0]))
    ends = run_to_end(two_scenes, network, starts)
    env.close()
    assert two_scenes.memory == 1 and ends.reached[0, 0]
    first, second = network.seen[:2]
    assert torch.equal(first[:, 0], first[:, 1])  # a flight starts with a still
    assert torch.equal(second[:, 0], first[:, 1]) and not torch.equal(second[:, 1], first[:, 1])
