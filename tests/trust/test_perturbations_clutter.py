import pytest
import torch

from drone_rl.config import CameraSettings, PillarsSettings, TaskSettings
from drone_rl.sim.rendering.scene import SemanticClass
from drone_rl.sim.worlds import Worlds
from drone_rl.trust.agents import OracleAgent
from drone_rl.trust.paired_evaluation import PairedEvaluator
from drone_rl.trust.perturbations import (
    MAX_DISTRACTORS,
    Condition,
    as_bright,
    clutter,
    sample_distractors,
    task_region,
)
from drone_rl.utils.errors import InputError
from tests.trust.subjects import subject

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
    places = sample_distractors(CUBES.object_region, 500, torch.Generator().manual_seed(0))
    assert places.shape == (500, MAX_DISTRACTORS, 3)
    x, y, z = places.flatten(0, 1).T
    assert 7.5 <= x.min() < 8 and 40 < x.max() <= 7.5 + 33
    assert 8 <= y.abs().min() < 8.1 and 15.9 < y.abs().max() <= 16
    assert abs((y > 0).double().mean() - 0.5) < 0.03
    assert (z == 2.5).all()


def test_they_are_as_large_as_what_matters_and_come_after_those_that_were_there():
    places = torch.arange(12.0).reshape(2, 2, 3)
    look = clutter(None, CUBES.object_region, places)
    assert look.distractors.sizes.tolist() == [[2.5, 2.5]] * 2
    assert look.distractors.colors[1, 0].tolist() == pytest.approx(as_bright(CUBES.cube_color))
    both = clutter(look, CUBES.object_region, 1 + places[:, :1])
    assert both.distractors.places.tolist() == torch.cat([places, 1 + places[:, :1]], 1).tolist()


def test_they_are_behind_the_props_of_a_task():
    worlds = Worlds(2, CUBES, num_shards=1, distractors=4)
    scene = worlds.scene
    assert len(scene.geoms(SemanticClass.DISTRACTOR)) == 4
    assert {*scene.props} == {-1, 0, 1, 2, 3, 4, 5, 6}
    hidden = worlds.poses(worlds.state).props
    assert hidden.shape == (2, 7, 3) and (hidden[:, 3:, 2] == -100.0).all()
    worlds.close()


def test_who_knows_what_is_what_does_not_mind_them():
    evaluator = PairedEvaluator(
        subject(task=TaskSettings(num_cubes=1), camera=CameraSettings()), 20
    )
    for count in (0, 16):
        assert evaluator.run(Condition(clutter=count), agent=OracleAgent()).episodes.success.all()
    evaluator.close()


def test_tasks_of_which_nothing_is_known():
    assert task_region(PillarsSettings()).size == 1.0

    class Other(PillarsSettings):
        name = "other"
        object_region = None

    with pytest.raises(InputError, match="axes=distractors is not for task=other"):
        task_region(Other())
