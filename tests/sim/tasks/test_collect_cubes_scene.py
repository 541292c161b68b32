"""Hand-computed props, info, goals and oracle actions of cube collection."""

import torch

from drone_rl.config import TaskSettings
from drone_rl.sim.actions import MOVES, Move
from drone_rl.sim.tasks.collect_cubes import CollectCubes, CubeGoals, EndReason, turn_towards
from drone_rl.sim.tasks.common import HIDDEN_DEPTH
from drone_rl.sim.worlds import Worlds
from drone_rl.utils.seeding import world_random_state

TASK = CollectCubes(TaskSettings(num_cubes=2, step_length=0.5, altitude=3.0))


def start():
    drawn = torch.tensor([[[15.0, 1.0, 3.0], [24.0, -2.0, 3.0]]], dtype=torch.float64)
    origin = torch.tensor([TASK.origin], dtype=torch.float64)
    return TASK.start(drawn, TASK.make_dynamics().start(origin))


def test_settings_define_scene_and_moves():
    assert (TASK.largest_reward, TASK.drone_size, TASK.origin) == (2.0, 0.8, (0.0, 0.0, 3.0))
    moved = TASK.make_dynamics().step(start().body, torch.tensor([Move.LEFT]))
    assert moved.position.tolist() == [[0.0, 0.5, 3.0]]
    assert [cube.mjcf_model.model for cube in TASK.make_props()] == ["cube_0", "cube_1"]


def test_removed_cubes_are_below_the_floor():
    state = start()
    state.collected[0, 0] = True
    first, second = TASK.places(state)[0].tolist()
    assert first == [15.0, 1.0, 3.0 - HIDDEN_DEPTH] and second == [24.0, -2.0, 3.0]
    state.passed[0, 1] = True
    assert (TASK.places(state)[..., 2] < 0).all()


def test_info_matches_hand_computed_values():
    state = start()
    info = TASK.info(state)
    assert info["cubes"].tolist() == [[0]] and info["next_cube"].tolist() == [[0]]
    assert info["side"].tolist() == [[1, -1]] and info["lateral"][0, 0] == 1.0
    state.collected[0, 0] = True
    info = TASK.info(state)
    assert info["cubes"].tolist() == [[1]] and info["next_cube"].tolist() == [[1]]


def test_first_environments_do_not_depend_on_batch_size():
    few, many = Worlds(2, TASK), Worlds(4, TASK)
    for worlds in (few, many):
        number = worlds.num_envs
        worlds.reset(torch.arange(number), [world_random_state(1, i) for i in range(number)])
        worlds.close()
    assert torch.equal(few.state.cubes, many.state.cubes[:2])


def test_entries_have_bounds():
    bounds = {name: (entry.low, entry.high) for name, entry in TASK.entries.items()}
    assert bounds["side"] == (-1, 2)  # unknown, or one of three
    assert bounds["next_cube"] == bounds["cubes"] == (0, 2)
    assert bounds["end_reason"] == (0, 5)


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


def test_oracle_turns_towards_cubes_beyond_its_tolerance():
    lateral = torch.tensor([3.0, 0.5, 0.0, -0.5, -3.0, 0.6, torch.nan])
    assert turn_towards(lateral, 0.5).tolist() == [L, F, F, F, R, L, F]


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


def test_task_names_its_ends():
    task = CollectCubes()
    assert (task.name, task.vocabulary.goal) == ("collect_cubes", "cube")
    assert task.strata == ("left", "ahead", "right")
    assert task.blind_baselines == ("random", *MOVES.names)
    assert task.ends(task.success_end) is EndReason.ALL_CUBES
    assert task.ends(task.expected_end) is EndReason.FRONT_BOUNDARY


def test_height_classes_need_varying_heights():
    none = torch.zeros(1, 1)
    cube = CubeGoals(none > 0, none.long(), none, none.double(), none.double())
    level = {by for by, *_ in CollectCubes(TaskSettings(num_cubes=1)).classes(cube)}
    tall = CollectCubes(TaskSettings(num_cubes=1, vertical_bound=0.6)).classes(cube)
    assert level == {"cube", "side", "sideways"}
    assert {by for by, *_ in tall} == level | {"height"}


def test_default_settings_are_those_of_the_original_study():
    assert CollectCubes().settings == TaskSettings()
    assert CollectCubes(TaskSettings(num_cubes=5)).largest_reward == 5.0
