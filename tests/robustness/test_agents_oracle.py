"""Who knows where every cube is that shows: it succeeds where that is enough, and fails else."""

import pytest
import torch

from drone_rl.config import CameraSettings, PillarsSettings, TaskSettings
from drone_rl.robustness.agents import OracleAgent, has_oracle
from drone_rl.robustness.faults import DeadRows, Noise
from drone_rl.robustness.paired_evaluation import PairedEvaluator
from drone_rl.robustness.perturbations import Condition
from drone_rl.sim.tasks import as_task
from tests.robustness.subjects import subject


@pytest.fixture
def bed():
    made = PairedEvaluator(subject(task=TaskSettings(num_cubes=2), camera=CameraSettings()), 30)
    yield made
    made.close()


def success(bed, condition, **kwargs):
    return float(bed.fly(condition, eyes=OracleAgent(**kwargs)).episodes.success.mean())


def test_it_collects_what_it_sees_and_knows_its_own_delay(bed):
    assert success(bed, Condition()) == 1.0
    assert success(bed, Condition(delay=5)) == 1.0
    assert success(bed, Condition(faults=(Noise(1.0),))) == 1.0


def test_it_is_as_good_as_luck_where_nothing_shows(bed):
    hidden = Condition(faults=(DeadRows(25),))  # of 25
    forward = float(bed.fly_blindly(Condition())["forward"].success.mean())
    assert success(bed, hidden) == forward < 0.5
    assert success(bed, hidden, looks=False) == 1.0


def test_it_does_not_know_what_is_out_of_sight(bed):
    narrow = success(bed, Condition(camera={"horizontal_fov": 10.0}))
    assert narrow < success(bed, Condition(camera={"horizontal_fov": 60.0}))


def test_of_pillars_it_knows_nothing_to_hide():
    assert has_oracle(as_task(TaskSettings()))
    assert not has_oracle(as_task(PillarsSettings()))


def test_it_has_seen_nothing_that_can_be_compared(bed):
    assert torch.equal(bed.fly(Condition(), eyes=OracleAgent()).trace, torch.zeros(30).double())
