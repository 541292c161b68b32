import pytest
import torch
from tensordict import TensorDict

from drone_rl.config import TaskSettings
from drone_rl.policies.baselines import constant_policy, oracle_policy, random_policy
from drone_rl.sim.actions import MOVES, Move
from drone_rl.sim.continuous_actions import ContinuousActions
from drone_rl.sim.tasks import CollectCubes
from drone_rl.utils.errors import InputError
from tests.continuous import SETTINGS
from tests.second_task import Posts


def test_oracle_follows_the_rule_of_the_task():
    info = {
        "drone": torch.zeros(3, 3),
        "cube_positions": torch.tensor([[[9.0, y, 0.0]] for y in (4.0, 0.1, -4.0)]),
        "next_cube": torch.zeros(3, 1, dtype=torch.int64),
    }
    seen = TensorDict({"info": TensorDict(info, [3])}, [3])
    for task in (TaskSettings(num_cubes=1), CollectCubes()):
        assert oracle_policy(task)(seen)["action"].tolist() == [Move.LEFT, Move.FORWARD, Move.RIGHT]
    assert oracle_policy(Posts()).in_keys == [("info", "end_reason")]


def test_task_without_an_oracle_is_refused():
    class Blind(Posts):
        name, oracle = "fog", None

    with pytest.raises(InputError, match="task=fog has no oracle; choose a task that has one") as e:
        oracle_policy(Blind())
    assert "\n" not in str(e.value)


def test_random_and_constant_actions():
    done = TensorDict({"done": torch.zeros(3000, 1, dtype=torch.bool)}, [3000])
    drawn = random_policy(MOVES, torch.Generator().manual_seed(0))(done)["action"]
    assert all(900 < int((drawn == action).sum()) < 1100 for action in Move)
    assert constant_policy(Move.RIGHT)(done)["action"].unique().tolist() == [2]


def test_random_and_constant_continuous_actions():
    actions = ContinuousActions.of(SETTINGS)
    done = TensorDict({"done": torch.zeros(3000, 1, dtype=torch.bool)}, [3000])
    drawn = random_policy(actions, torch.Generator().manual_seed(0))(done)["action"]
    assert drawn.shape == (3000, 3) and drawn.dtype == torch.float32
    assert drawn.mean(0).abs().max() < 0.05 and drawn.abs().max() <= 1  # 0.58 / 55 * 4
    habit = constant_policy(actions.always("right"))(done)["action"]
    assert habit.shape == (3000, 3) and habit[7].tolist() == [-1, -1, 0]


def test_oracle_with_continuous_actions():
    info = {
        "drone": torch.zeros(3, 3),
        "cube_positions": torch.tensor([[[9.0, y, 0.0]] for y in (4.0, 0.1, -4.0)]),
        "next_cube": torch.zeros(3, 1, dtype=torch.int64),
    }
    seen = TensorDict({"info": TensorDict(info, [3])}, [3])
    oracle = oracle_policy(TaskSettings(num_cubes=1), ContinuousActions.of(SETTINGS))
    assert oracle(seen)["action"].tolist() == [[-1, 1, 0], [1, 0, 0], [-1, -1, 0]]
