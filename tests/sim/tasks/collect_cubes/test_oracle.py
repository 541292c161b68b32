import torch

from drone_rl.config import TaskSettings
from drone_rl.sim.actions import Move
from drone_rl.sim.tasks.collect_cubes.oracle import line_up, turn_towards

F, L, R = Move.FORWARD, Move.LEFT, Move.RIGHT


def test_it_turns_towards_what_is_farther_aside_than_it_tolerates():
    lateral = torch.tensor([3.0, 0.5, 0.0, -0.5, -3.0, 0.6, torch.nan])
    assert turn_towards(lateral, 0.5).tolist() == [L, F, F, F, R, L, F]


def test_it_lines_up_with_the_next_cube_and_flies_on_when_none_is_left():
    """It tolerates half the touch distance of 1.65 m."""
    drone = torch.tensor([[0.0, 1.0, 2.5]] * 4)
    cubes = torch.tensor([[[9.0, 1.8, 2.5], [18.0, 1.9, 2.5]]] * 4)
    cubes[3, 1, 1] = 0.1
    following = torch.tensor([[0], [1], [2], [1]])
    assert line_up(TaskSettings(), drone, cubes, following).tolist() == [F, L, F, R]


def test_it_is_never_finer_than_half_a_step():
    settings = TaskSettings(cube_size=0.3, drone_size=1.7, step_length=1.0, altitude=2.5)
    drone, near = torch.zeros(1, 3), torch.tensor([[[9.0, 0.49, 0.0]]])
    first = torch.tensor([[0]])
    assert line_up(settings, drone, near, first).tolist() == [F]
    assert line_up(settings, drone, near + 0.03, first).tolist() == [L]
