import pytest
import torch
from torchrl.envs.utils import check_env_specs

from drone_rl.config import TaskSettings
from drone_rl.sim.composer_task import make_environment
from drone_rl.sim.dynamics import Kinematic
from tests.composer_env import ComposerEnv
from tests.continuous import SETTINGS

SHORT = TaskSettings(step_limit=32)


@pytest.fixture
def env():
    return ComposerEnv(make_environment(SHORT, pixels=False, random_state=0))


def test_specs(env):
    check_env_specs(env)


def test_seed_determines_episodes(env):
    def places(seed):
        env.set_seed(seed)
        env.reset()
        return env._env.task.state.cubes.clone()

    assert torch.equal(places(3), places(3))
    assert not torch.equal(places(3), places(4))


def test_time_limit_truncates_and_boundary_terminates(env):
    state = env.rollout(40, policy=lambda td: td.set("action", torch.tensor(1)))
    assert state["next", "terminated"][-1].item()  # 27 steps to the left
    assert len(state) == 27
    turn = iter([1, 2] * 30)
    state = env.rollout(40, policy=lambda td: td.set("action", torch.tensor(next(turn))))
    assert state["next", "truncated"][-1].item()
    assert len(state) == 32


def test_velocity_actions_are_bounded():
    dynamics = Kinematic(SETTINGS)
    env = ComposerEnv(make_environment(SHORT, pixels=False, random_state=0, dynamics=dynamics))
    check_env_specs(env)
    assert env.action_spec.shape == (3,) and env.action_spec.dtype.is_floating_point
    fastest = torch.tensor([1.0, 1.0, 0.0], dtype=torch.float64)
    env.rollout(5, policy=lambda td: td.set("action", fastest))
    position = env._env.task.state.body.position[0]
    assert position[:2].tolist() == pytest.approx([2.0, 1.5])


def test_other_environments_raise():
    with pytest.raises(TypeError, match="composer"):
        ComposerEnv(object())
