from types import SimpleNamespace

import pytest
import torch

from drone_rl.collectors.complete_episodes import rollout
from drone_rl.config import TaskSettings
from drone_rl.envs import DroneEnv
from drone_rl.policies.baselines import ConstantAgent, OracleAgent, RandomAgent, make_baseline
from drone_rl.sim.actions import MOVE_SETS, Move
from drone_rl.sim.tasks import as_task
from drone_rl.sim.worlds import Worlds
from drone_rl.trust.baselines import BASELINES, run_baselines
from drone_rl.utils.errors import InputError
from drone_rl.utils.seeding import side_stream, world_random_state
from tests.continuous import make_env
from tests.second_dynamics import Turning

TASK = TaskSettings(num_cubes=1)


@pytest.fixture
def policies():
    """What each baseline is; random actions follow from the first environment's stream alone."""
    stream = side_stream(world_random_state(5, 0), 5)
    generator = torch.Generator().manual_seed(int(stream.integers(2**63)))
    fixed = {action.name.lower(): ConstantAgent(action) for action in Move}
    return {"oracle": OracleAgent(), "random": RandomAgent(generator), **fixed}


def test_baselines_run_from_the_same_initial_states(policies, monkeypatch):
    monkeypatch.setattr(Worlds, "render", lambda *args: pytest.fail("nobody looks"))
    env = DroneEnv(4, TASK, pixels=False, seed=5)
    worlds = env.state_dict()
    flown = run_baselines(4, TASK, worlds, 6)
    assert tuple(flown) == BASELINES and set(BASELINES) == set(policies)
    for name, episodes in flown.items():
        env.load_state_dict(worlds)
        expected = rollout(policies[name], env, 6)
        assert torch.equal(episodes.length, expected.length), name
        for field, values in vars(expected.goals).items():
            found = getattr(episodes.goals, field)
            assert torch.equal(found.nan_to_num(), values.nan_to_num()), (name, field)
    assert len(flown["oracle"]) == 6 and flown["oracle"].success.all()


def test_baselines_with_continuous_actions():
    env = make_env(6)
    flown = run_baselines(
        6,
        env.base_env.worlds.task,
        env.base_env.state_dict(),
        6,
        dynamics=env.base_env.worlds.dynamics,
    )
    env.close()
    assert tuple(flown) == BASELINES and flown["oracle"].success.all()
    assert flown["forward"].length.max() == 10  # x = 9 m is the bound; 4 m/s for 0.25 s
    assert flown["left"].length.tolist() == [10] * 6  # y = 7 m; 3 m/s for 0.25 s
    assert len(set(flown["random"].length.tolist())) > 1


def test_baseline_that_is_no_action_is_refused():
    with pytest.raises(InputError, match=r"baseline=forward of task=.* which have fly, turn left"):
        make_baseline("forward", as_task(TASK), Turning.actions, torch.Generator())


def test_a_drone_that_only_turns_has_baselines_that_turn():
    for name, action in (("forward", 0), ("left", 1), ("right", 2)):
        turning = MOVE_SETS["moves_turning"]
        agent = make_baseline(name, as_task(TASK), turning, torch.Generator())
        assert agent.act(SimpleNamespace(rows=torch.arange(2))).action.tolist() == [action] * 2


def test_oracle_of_other_actions_is_refused():
    actions = SimpleNamespace(names=("throttle", "pitch"))
    with pytest.raises(InputError, match="acts by forward, left, right, these drones by throttle"):
        make_baseline("oracle", as_task(TASK), actions, torch.Generator())
