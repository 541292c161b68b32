"""Cube collection for simulators, with numbers by hand; its rules have tests of their own."""

import torch

from drone_rl.config import TaskSettings
from drone_rl.sim.actions import Move
from drone_rl.sim.tasks import CollectCubes
from drone_rl.sim.tasks.collect_cubes.playing import VANISHED_DEPTH
from drone_rl.sim.worlds import Worlds
from drone_rl.utils.seeding import world_random_state

TASK = CollectCubes(TaskSettings(num_cubes=2, step_length=0.5, altitude=3.0))


def start():
    drawn = torch.tensor([[[15.0, 1.0, 3.0], [24.0, -2.0, 3.0]]], dtype=torch.float64)
    origin = torch.tensor([TASK.origin], dtype=torch.float64)
    return TASK.start(drawn, TASK.make_dynamics().start(origin))


def test_what_settings_make_of_it():
    assert (TASK.largest_reward, TASK.drone_size, TASK.origin) == (2.0, 0.8, (0.0, 0.0, 3.0))
    moved = TASK.make_dynamics().step(start().body, torch.tensor([Move.LEFT]))
    assert moved.position.tolist() == [[0.0, 0.5, 3.0]]
    assert [cube.mjcf_model.model for cube in TASK.make_props()] == ["cube_0", "cube_1"]


def test_vanished_cubes_are_deep_under_the_floor():
    state = start()
    state.collected[0, 0] = True
    first, second = TASK.places(state)[0].tolist()
    assert first == [15.0, 1.0, 3.0 - VANISHED_DEPTH] and second == [24.0, -2.0, 3.0]
    state.passed[0, 1] = True
    assert (TASK.places(state)[..., 2] < 0).all()


def test_information_by_hand():
    state = start()
    told = TASK.info(state)
    assert told["cubes"].tolist() == [[0]] and told["next_cube"].tolist() == [[0]]
    assert told["side"].tolist() == [[1, -1]] and told["lateral"][0, 0] == 1.0
    state.collected[0, 0] = True
    told = TASK.info(state)
    assert told["cubes"].tolist() == [[1]] and told["next_cube"].tolist() == [[1]]
    told["collected"].zero_()
    assert state.collected[0, 0]  # what is told is a copy


def test_the_first_worlds_are_the_same_whatever_the_number_of_worlds():
    few, many = Worlds(2, TASK), Worlds(4, TASK)
    for worlds in (few, many):
        number = worlds.num_worlds
        worlds.reset(torch.arange(number), [world_random_state(1, i) for i in range(number)])
        worlds.close()
    assert torch.equal(few.state.cubes, many.state.cubes[:2])


def test_bounds_of_what_is_reported():
    bounds = {name: (entry.low, entry.high) for name, entry in TASK.entries.items()}
    assert bounds["side"] == (-1, 2)  # not known yet, or one of three
    assert bounds["next_cube"] == bounds["cubes"] == (0, 2)
    assert bounds["end_reason"] == (0, 5)
