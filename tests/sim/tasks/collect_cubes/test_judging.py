import torch

from drone_rl.config import TaskSettings
from drone_rl.sim.actions import MOVES
from drone_rl.sim.tasks import CollectCubes
from drone_rl.sim.tasks.collect_cubes.goals import CubeGoals
from drone_rl.sim.tasks.collect_cubes.rules import EndReason


def test_names_are_those_of_verdicts():
    task = CollectCubes()
    assert (task.name, task.terms.goal) == ("collect_cubes", "cube")
    assert task.strata == ("left", "ahead", "right")
    assert task.luck == ("random", *MOVES.names)
    assert task.ends(task.success_end) is EndReason.ALL_CUBES
    assert task.ends(task.expected_end) is EndReason.FRONT_BOUNDARY


def test_heights_are_a_class_only_where_cubes_differ_in_them():
    none = torch.zeros(1, 1)
    cube = CubeGoals(none > 0, none.long(), none, none.double(), none.double())
    level = {by for by, *_ in CollectCubes(TaskSettings(num_cubes=1)).classes(cube)}
    tall = CollectCubes(TaskSettings(num_cubes=1, vertical_bound=0.6)).classes(cube)
    assert level == {"cube", "side", "sideways"}
    assert {by for by, *_ in tall} == level | {"height"}
