import pytest
import torch

from drone_rl.config import TaskSettings
from drone_rl.envs import Observer
from drone_rl.envs.rollout import StepContext
from drone_rl.policies.baselines import ConstantAgent, OracleAgent, RandomAgent, make_baseline
from drone_rl.sim.actions import MOVES, Move
from drone_rl.sim.continuous_actions import ContinuousActions
from drone_rl.sim.worlds import Worlds
from drone_rl.utils.errors import InputError
from tests.continuous import SETTINGS
from tests.second_task import Posts


def acted(agent, num_envs=3, lateral=0.0, **options):
    """Return what an agent does at the start of episodes, with cubes metres to the left."""
    worlds = Worlds(num_envs, TaskSettings(num_cubes=1), **options)
    worlds.state.places[:, 0, 1] = torch.as_tensor(lateral, dtype=torch.float64)
    rows = torch.arange(num_envs)
    context = StepContext(Observer(worlds), worlds.state, rows, torch.ones(num_envs).bool())
    return agent.act(context).action


def test_oracle_follows_the_rule_of_the_task():
    lateral = [4.0, 0.1, -4.0]
    assert acted(OracleAgent(), lateral=lateral).tolist() == [Move.LEFT, Move.FORWARD, Move.RIGHT]
    velocities = acted(OracleAgent(), lateral=lateral, actions=SETTINGS)
    assert velocities.tolist() == [[-1, 1, 0], [1, 0, 0], [-1, -1, 0]]


def test_task_without_an_oracle_is_refused():
    class Blind(Posts):
        name, oracle = "fog", None

    with pytest.raises(InputError, match="task=fog has no oracle; choose a task that has one") as e:
        make_baseline("oracle", Blind(), MOVES, torch.Generator())
    assert "\n" not in str(e.value)


def test_random_and_constant_actions():
    taken = acted(RandomAgent(torch.Generator().manual_seed(0)), 3000)
    assert all(900 < int((taken == action).sum()) < 1100 for action in Move)
    assert acted(ConstantAgent(Move.RIGHT)).tolist() == [2, 2, 2]


def test_random_and_constant_continuous_actions():
    taken = acted(RandomAgent(torch.Generator().manual_seed(0)), 3000, actions=SETTINGS)
    assert taken.shape == (3000, 3) and taken.dtype == torch.float32
    assert taken.mean(0).abs().max() < 0.05 and taken.abs().max() <= 1  # 0.58 / 55 * 4
    right = ContinuousActions.of(SETTINGS).always("right")
    assert acted(ConstantAgent(right)).tolist() == [[-1, -1, 0]] * 3
