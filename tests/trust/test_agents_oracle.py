"""Who knows where every cube is that shows: it succeeds where that is enough, and fails else."""

import pytest
import torch

from drone_rl.config import CameraSettings, PillarsSettings, TaskSettings
from drone_rl.envs.fault_models import dead_rows, noise
from drone_rl.sim.tasks import as_task
from drone_rl.trust.agents import OracleAgent, has_oracle
from drone_rl.trust.paired_evaluation import PairedEvaluator
from drone_rl.trust.perturbations import Condition
from tests.trust.subjects import subject


@pytest.fixture
def evaluator():
    made = PairedEvaluator(subject(task=TaskSettings(num_cubes=2), camera=CameraSettings()), 30)
    yield made
    made.close()


def success(evaluator, condition, **kwargs):
    return float(evaluator.run(condition, agent=OracleAgent(**kwargs)).episodes.success.mean())


def test_it_collects_what_it_sees_and_knows_its_own_delay(evaluator):
    assert success(evaluator, Condition()) == 1.0
    assert success(evaluator, Condition(delay=5)) == 1.0
    assert success(evaluator, Condition(faults=(noise(1.0),))) == 1.0


def test_it_is_as_good_as_luck_where_nothing_shows(evaluator):
    hidden = Condition(faults=(dead_rows(25),))  # of 25
    forward = float(evaluator.run_baselines(Condition())["forward"].success.mean())
    assert success(evaluator, hidden) == forward < 0.5
    assert success(evaluator, hidden, only_visible=False) == 1.0


def test_it_does_not_know_what_is_out_of_sight(evaluator):
    narrow = success(evaluator, Condition(camera={"horizontal_fov": 10.0}))
    assert narrow < success(evaluator, Condition(camera={"horizontal_fov": 60.0}))


def test_of_pillars_it_knows_nothing_to_hide():
    assert has_oracle(as_task(TaskSettings()))
    assert not has_oracle(as_task(PillarsSettings()))


def test_it_has_seen_nothing_that_can_be_compared(evaluator):
    assert torch.equal(
        evaluator.run(Condition(), agent=OracleAgent()).trace, torch.zeros(30).double()
    )
