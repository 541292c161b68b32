"""Classes of cubes; that failure tables count by them is tested with those."""

import torch

from drone_rl.config import TaskSettings
from drone_rl.sim.tasks import CollectCubes
from drone_rl.sim.tasks.collect_cubes.goals import sideways_edges


def test_classes_of_distance_fit_the_task():
    assert sideways_edges(TaskSettings()) == [1.65, 4.0, 6.0, 9.0]
    assert sideways_edges(TaskSettings(lateral_bound=3.0)) == [1.65, 2.5, 3.0, 4.5]
    assert sideways_edges(TaskSettings(lateral_bound=0.5)) == [1.65]


def test_goals_are_made_of_the_last_information():
    info = {
        "collected": torch.tensor([[True, False]]),
        "side": torch.tensor([[2, -1]]),
        "lateral": torch.tensor([[-3.0, torch.nan]]).double(),
        "cube_positions": torch.tensor([[[15.0, -3.0, 2.0], [24.0, 1.0, 3.0]]]),
        "drone": torch.tensor([[30.0, 0.0, 2.5]]),
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
