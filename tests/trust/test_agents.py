import pytest
import torch
from torchrl.envs import CatFrames

from drone_rl.config import CameraSettings, PillarsSettings, TaskSettings
from drone_rl.envs import GrayPixels
from drone_rl.envs.fault_models import dead_rows, noise
from drone_rl.envs.transforms import PixelTransform
from drone_rl.policies import ImageNetwork
from drone_rl.sim.actions import MOVES
from drone_rl.sim.continuous_actions import ContinuousActions
from drone_rl.sim.tasks import as_task
from drone_rl.sim.worlds import Worlds
from drone_rl.trust.agents import BaselineAgent, OracleAgent, PolicyAgent, StepContext, has_oracle
from drone_rl.trust.paired_evaluation import PairedEvaluator
from drone_rl.trust.perturbations import Condition
from tests.continuous import SETTINGS
from tests.trust.subjects import TASK, subject


class Looking(ImageNetwork):
    """Keeps what it was shown, and turns left."""

    def __init__(self):
        super().__init__()
        self.shown = []

    def forward(self, pixels):
        self.shown.append(pixels)
        return torch.tensor([0.0, 1.0, 0.0]).expand(len(pixels), 3)


def sight(worlds, flying, spoil=lambda pictures, flying, nothing=0.0: pictures):
    state = worlds.state[flying]
    return StepContext(worlds, state, flying, worlds.poses(state), None, spoil, [])


def make_env():
    return Worlds(3, TASK, CameraSettings(width=16, height=5), num_shards=1)


def test_policy_observes_transformed_images_with_faults():
    worlds, network = make_env(), Looking()
    flying = torch.tensor([0, 2])
    agent = PolicyAgent(network, [GrayPixels()], 3)
    action, seen = agent.act(sight(worlds, flying, lambda p, f, nothing=0.0: p / 2))
    gray = GrayPixels()._apply_transform(worlds.render(worlds.state[flying]))
    worlds.close()
    assert action.tolist() == [1, 1]
    torch.testing.assert_close(network.shown[0], gray / 2)
    assert seen is network.shown[0]


def test_frame_stack_of_the_active_environments():
    worlds, network = make_env(), Looking()
    agent = PolicyAgent(network, [GrayPixels(), CatFrames(N=2, dim=-3, in_keys=["pixels"])], 3)
    step = iter((0.25, 0.5))

    def mark(pictures, flying, nothing=0.0):
        return torch.zeros_like(pictures) + next(step) + flying[:, None, None, None]

    agent.act(sight(worlds, torch.arange(3), mark))
    agent.act(sight(worlds, torch.tensor([1, 2]), mark))
    worlds.close()
    assert network.shown[0][:, :, 0, 0].tolist() == [[0.25] * 2, [1.25] * 2, [2.25] * 2]
    assert network.shown[1][:, :, 0, 0].tolist() == [[1.25, 1.5], [2.25, 2.5]]


class Tied(ImageNetwork):
    """Cannot decide between two actions in bright frames."""

    actions = MOVES

    def forward(self, pixels):
        lead = torch.where(pixels.amax((1, 2, 3)) > 0.5, 1e-7, 1.0)
        return torch.stack([lead, torch.zeros_like(lead), torch.full_like(lead, -1.0)], -1)


def test_fragile_episodes_are_recorded():
    worlds = make_env()
    bright = torch.tensor([1.0, 0.0, 0.0])
    for examines in (True, False):
        agent = PolicyAgent(Tied(), [GrayPixels()], 3, examines_rounding=examines)
        for flying in (torch.arange(3), torch.tensor([1, 2])):
            agent.act(sight(worlds, flying, lambda p, f: 0 * p + bright[f, None, None, None]))
        assert agent.is_fragile.tolist() == [examines, False, False]
    worlds.close()


def test_baseline_agents():
    worlds = make_env()
    where = sight(worlds, torch.arange(3))
    generator = torch.Generator().manual_seed(0)
    action, seen = BaselineAgent("right", MOVES, generator).act(where)
    assert (action.tolist(), seen) == ([2, 2, 2], None)
    agent = BaselineAgent("random", MOVES, generator)
    drawn = torch.cat([agent.act(where)[0] for _ in range(200)])
    worlds.close()
    assert (drawn.bincount() / 600 - 1 / 3).abs().max() < 0.08


def test_baseline_agents_with_continuous_actions():
    worlds, actions = make_env(), ContinuousActions.of(SETTINGS)
    where, generator = sight(worlds, torch.arange(2)), torch.Generator().manual_seed(0)
    action, _ = BaselineAgent("forward", actions, generator).act(where)
    assert action.tolist() == [[1, 0, 0]] * 2
    assert BaselineAgent("random", actions, generator).act(where)[0].shape == (2, 3)
    worlds.close()


class Signed(PixelTransform):
    """Gray levels from -1 to 1."""

    def _apply_transform(self, obs):
        return 2 * GrayPixels()._apply_transform(obs) - 1


def test_faults_come_before_a_users_first_transform():
    worlds, network = make_env(), Looking()
    agent = PolicyAgent(network, [Signed()], 3)
    agent.act(sight(worlds, torch.arange(3), lambda p, f, nothing=0.0: p.clamp(0, 1)))
    wanted = Signed()._apply_transform(worlds.render(worlds.state))
    worlds.close()
    torch.testing.assert_close(network.shown[0], wanted)


@pytest.fixture
def evaluator():
    made = PairedEvaluator(subject(task=TaskSettings(num_cubes=2), camera=CameraSettings()), 30)
    yield made
    made.close()


def success(evaluator, condition, **kwargs):
    return float(evaluator.run(condition, agent=OracleAgent(**kwargs)).episodes.success.mean())


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
    assert has_oracle(as_task(TaskSettings()))
    assert not has_oracle(as_task(PillarsSettings()))
