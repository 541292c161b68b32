import pytest
import torch

from drone_rl.conditions.clutter import MOST, Cluttered, as_bright, draw_places, told_by
from drone_rl.conditions.condition import Condition
from drone_rl.conditions.flying import Airfield
from drone_rl.conditions.oracle import OracleEyes
from drone_rl.sim.meaning import Meaning
from drone_rl.sim.settings import CameraSettings, PillarsSettings, TaskSettings
from drone_rl.sim.tasks import as_task
from drone_rl.sim.worlds import Worlds
from drone_rl.utils.errors import InputError
from tests.conditions.subjects import subject

CUBES = TaskSettings()


def test_they_are_blue_and_as_bright():
    red, green, blue = as_bright((0.75, 0.12, 0.08))
    assert 0.299 * red + 0.587 * green + 0.114 * blue == pytest.approx(0.30381)
    assert blue > green > red
    assert as_bright((1.0, 1.0, 1.0)) == (
        pytest.approx(0.4895, abs=1e-3),
        pytest.approx(0.979, abs=1e-3),
        1.0,
    )


def test_they_stand_beside_the_way():
    places = draw_places(CUBES, 500, torch.Generator().manual_seed(0))
    assert places.shape == (500, MOST, 3)
    x, y, z = places.flatten(0, 1).T
    assert 7.5 <= x.min() < 8 and 40 < x.max() <= 7.5 + 33
    assert 8 <= y.abs().min() < 8.1 and 15.9 < y.abs().max() <= 16
    assert abs((y > 0).double().mean() - 0.5) < 0.03
    assert (z == 2.5).all()


def test_a_task_has_them_behind_its_own_props():
    task = as_task(CUBES)
    worlds = Worlds(1, Cluttered(task, CUBES, 4), num_shards=1)
    scene = worlds.scene
    assert [m for m in scene.meanings if m is Meaning.OBSTACLE] == [Meaning.OBSTACLE] * 4
    assert {*scene.props} == {-1, 0, 1, 2, 3, 4, 5, 6}
    assert worlds.task.largest_reward == task.largest_reward
    worlds.close()


def test_who_knows_what_is_what_does_not_mind_them():
    bed = Airfield(subject(task=TaskSettings(num_cubes=1), camera=CameraSettings()), 20)
    for count in (0, 16):
        assert bed.fly(Condition(clutter=count), eyes=OracleEyes()).episodes.success.all()
    bed.close()


def test_tasks_of_which_nothing_is_known():
    assert told_by(PillarsSettings())[0] == 1.0

    class Other(PillarsSettings):
        name = "other"

    with pytest.raises(InputError, match="axes=distractors is not for task=other"):
        told_by(Other())
