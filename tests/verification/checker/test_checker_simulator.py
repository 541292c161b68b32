import itertools

import numpy as np
import pytest
import torch

import drone_rl
from drone_rl.collectors.complete_episodes import run_episodes
from drone_rl.sim.tasks.collect_cubes import EndReason
from drone_rl.verification.checker.checker import Simulator


@pytest.fixture
def make():
    made = []

    def simulator(name="good", **task):
        policy = drone_rl.load_policy(name).in_task(**task)
        made.append(Simulator(policy.description, policy.state["policy"]))
        return made[-1]

    yield simulator
    for one in made:
        one.close()


def test_flights_are_those_of_an_evaluation(make):
    policy = drone_rl.load_policy("right_and_forward")
    with policy.flying(20) as (env, actor):
        episodes = run_episodes(env, actor, 20)
    lateral = episodes.goals.world.reshape(20, 3, 3)[..., 1].double().numpy()
    flown = make("right_and_forward").fly(lateral)
    assert flown.end.tolist() == episodes.end_reason.tolist()
    assert flown.steps.tolist() == episodes.length.tolist()
    assert flown.collected.tolist() == episodes.goals.reached.tolist()


def test_a_cube_that_is_just_touched_and_one_that_is_not(make):
    flown = make("right_and_forward", num_cubes=1).fly(np.array([[1.64], [1.66]]))
    assert flown.end.tolist() == [EndReason.ALL_CUBES, EndReason.FRONT_BOUNDARY]
    assert flown.collected.tolist() == [[True], [False]]


def test_batches_are_joined_and_told_of(make):
    simulator, told = make(num_cubes=1), []
    simulator.batch_size = 2
    y = np.array([[-5.9], [0.0], [5.9], [0.1], [2.0]])
    flown = simulator.fly(y, lambda done, total: told.append((done, total)))
    assert told == [(2, 5), (4, 5), (5, 5)]
    assert flown.steps.tolist() == [19, 14, 19, 14, 15]
    assert len(simulator.fly(y[:0]).end) == 0


class Swaying(torch.nn.Module):
    """Left and right for ever."""

    def __init__(self):
        super().__init__()
        self.actions = itertools.cycle([1, 2])

    def forward(self, pixels):
        logits = torch.zeros(len(pixels), 3)
        logits[:, next(self.actions)] = 1.0
        return logits


def test_to_and_fro_goes_on_to_the_step_limit(make):
    simulator = make(num_cubes=1, step_limit=40)
    simulator._network = Swaying()
    flown = simulator.fly(np.zeros((2, 1)))
    assert flown.end.tolist() == [EndReason.STEP_LIMIT] * 2
    assert flown.steps.tolist() == [40, 40]
    assert flown.repeats.tolist() == [39, 39]


class Hesitating(torch.nn.Module):
    """Left and right a few times, then straight on."""

    def __init__(self):
        super().__init__()
        self.actions = itertools.chain([1, 2, 1, 2, 1, 2], itertools.repeat(0))

    def forward(self, pixels):
        logits = torch.zeros(len(pixels), 3)
        logits[:, next(self.actions)] = 1.0
        return logits


def test_repeats_begin_again_when_the_drone_moves_on(make):
    """Only the last steps count: who goes on after going to and fro ends without any."""
    simulator = make("good", num_cubes=1)
    simulator._network = Hesitating()
    assert simulator.fly(np.zeros((2, 1))).repeats.tolist() == [0, 0]


def test_straight_flights_repeat_nothing(make):
    assert make("poor", num_cubes=1).fly(np.zeros((1, 1))).repeats.tolist() == [0]


def test_large_pictures_come_in_small_batches():
    policy = drone_rl.load_policy("good")
    assert Simulator(policy.description, policy.state["policy"]).batch_size == 1024
