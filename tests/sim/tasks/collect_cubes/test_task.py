import pytest

from drone_rl.config import TaskSettings
from drone_rl.sim.tasks import CollectCubes
from drone_rl.sim.tasks.explainable import Explainable
from drone_rl.sim.tasks.judgeable import Judgeable
from drone_rl.sim.tasks.playable import Playable


def test_the_default_is_the_original_studys():
    assert CollectCubes().settings == TaskSettings()
    assert CollectCubes(TaskSettings(num_cubes=5)).largest_reward == 5.0


@pytest.mark.parametrize("protocol", [Playable, Judgeable, Explainable])
def test_it_has_all_that_is_asked_of_a_task(protocol):
    names = {*vars(protocol), *getattr(protocol, "__annotations__", {})}
    asked = {name for name in names if not name.startswith("_")}
    assert len(asked) > 5
    assert not [name for name in asked if not hasattr(CollectCubes(), name)]
