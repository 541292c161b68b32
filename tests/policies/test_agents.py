import pytest
import torch

from drone_rl.config import CameraSettings, PillarsSettings, TaskSettings
from drone_rl.envs import GrayPixels, Observer
from drone_rl.envs.fault_models import dead_rows, noise
from drone_rl.envs.rollout import StepContext
from drone_rl.policies import ImageNetwork, RecurrentNetwork, greedy_agent
from drone_rl.policies.baselines import OracleAgent, has_visible_oracle
from drone_rl.sim.actions import MOVES
from drone_rl.sim.tasks import as_task
from drone_rl.sim.worlds import Worlds
from drone_rl.trust.paired_evaluation import PairedEvaluator
from drone_rl.trust.perturbations import Condition
from tests.trust.subjects import TASK, subject


class Looking(ImageNetwork):
    """Keeps what it was shown, and turns left."""

    def __init__(self):
        super().__init__()
        self.shown = []

    def forward(self, pixels):
        self.shown.append(pixels)
        return torch.tensor([0.0, 1.0, 0.0]).expand(len(pixels), 3)


def make_env():
    return Worlds(3, TASK, CameraSettings(width=16, height=5), num_shards=1)


def sight(worlds, *rows, starts=True, pixels=None):
    """Return what an agent may use, with pixels of one gray level in each environment."""
    flying = torch.tensor(rows)
    is_start = torch.full((len(rows),), starts)
    context = StepContext(Observer(worlds, [GrayPixels()]), worlds.state[flying], flying, is_start)
    if pixels is not None:
        context.inputs = {"pixels": torch.tensor(pixels)[:, None, None, None].expand(-1, 1, 12, 16)}
    return context


def test_policy_acts_on_what_is_observed():
    worlds, network = make_env(), Looking()
    act = greedy_agent(network).act(sight(worlds, 0, 2))
    gray = GrayPixels()._apply_transform(worlds.render(worlds.state[torch.tensor([0, 2])]))
    worlds.close()
    assert act.action.tolist() == [1, 1] and act.distribution.shape == (2, 3)
    torch.testing.assert_close(network.shown[0], gray)


def test_recurrent_policies_keep_a_state_of_each_environment():
    """As the same network in one environment at a time, restarted where an episode starts."""
    worlds = make_env()
    network = RecurrentNetwork((1, 12, 16), 3, generator=torch.Generator().manual_seed(0)).eval()
    network.actions, agent = MOVES, greedy_agent(network)
    with torch.no_grad():
        agent.act(sight(worlds, 0, 1, 2, pixels=[0.1, 0.5, 0.9]))
        second = agent.act(sight(worlds, 0, 2, starts=False, pixels=[0.2, 0.3])).distribution
        again = agent.act(sight(worlds, 2, pixels=[0.9])).distribution
        for i, (before, now) in enumerate(((0.1, 0.2), (0.9, 0.3))):
            frames = [torch.full((1, 1, 12, 16), level) for level in (before, now)]
            first, memory = network.step(frames[0], network.start(1))
            torch.testing.assert_close(second[i : i + 1], network.step(frames[1], memory)[0])
        torch.testing.assert_close(again, first)  # of 0.9, as at a start
    worlds.close()


class Tied(ImageNetwork):
    """Cannot decide between two actions in bright frames."""

    actions = MOVES

    def forward(self, pixels):
        lead = torch.where(pixels.amax((1, 2, 3)) > 0.5, 1e-7, 1.0)
        return torch.stack([lead, torch.zeros_like(lead), torch.full_like(lead, -1.0)], -1)


@pytest.fixture
def evaluator():
    made = PairedEvaluator(subject(task=TaskSettings(num_cubes=2), camera=CameraSettings()), 30)
    yield made
    made.close()


def success(evaluator, condition, only_visible=True):
    agent = OracleAgent(only_visible=only_visible)
    return float(evaluator.run(condition, agent=agent).episodes.success.mean())


def test_oracle_collects_what_is_visible_and_compensates_delay(evaluator):
    assert success(evaluator, Condition()) == 1.0
    assert success(evaluator, Condition(delay=5)) == 1.0
    assert success(evaluator, Condition(faults=(noise(1.0),))) == 1.0


def test_oracle_without_visible_cubes(evaluator):
    hidden = Condition(faults=(dead_rows(25),))  # of 25
    forward = float(evaluator.run_baselines(Condition())["forward"].success.mean())
    assert success(evaluator, hidden) == forward < 0.5
    assert success(evaluator, hidden, only_visible=False) == 1.0


def test_oracle_with_a_narrow_field_of_view(evaluator):
    narrow = success(evaluator, Condition(camera={"horizontal_fov": 10.0}))
    assert narrow < success(evaluator, Condition(camera={"horizontal_fov": 60.0}))


def test_oracles_limited_to_visible_cubes():
    assert has_visible_oracle(as_task(TaskSettings()))
    assert not has_visible_oracle(as_task(PillarsSettings()))
