from types import SimpleNamespace

import pytest
import torch

from drone_rl.collectors.complete_episodes import run_episodes
from drone_rl.config import TaskSettings
from drone_rl.envs import DroneEnv
from drone_rl.policies.baselines import constant_policy, make_baseline, oracle_policy, random_policy
from drone_rl.sim.actions import MOVES, Move
from drone_rl.sim.worlds import Worlds
from drone_rl.trust.baselines import BASELINES, run_baselines
from drone_rl.utils.errors import InputError
from drone_rl.utils.seeding import side_stream, world_random_state
from tests.continuous import make_env
from tests.second_task import Posts

TASK = TaskSettings(num_cubes=1)


@pytest.fixture
def policies():
    """What each baseline is; random actions follow from the first environment's stream alone."""
    stream = side_stream(world_random_state(5, 0), 5)
    generator = torch.Generator().manual_seed(int(stream.integers(2**63)))
    fixed = {action.name.lower(): constant_policy(action) for action in Move}
    return {"oracle": oracle_policy(TASK), "random": random_policy(MOVES, generator), **fixed}


def test_baselines_are_flown_in_the_same_worlds_one_by_one(policies, monkeypatch):
    monkeypatch.setattr(Worlds, "render", lambda *args: pytest.fail("nobody looks"))
    env = DroneEnv(4, TASK, pixels=False, seed=5)
    worlds = env.state_dict()
    flown = run_baselines(4, TASK, worlds, 6)
    assert tuple(flown) == BASELINES and set(BASELINES) == set(policies)
    for name, episodes in flown.items():
        env.load_state_dict(worlds)
        expected = run_episodes(env, policies[name], 6)
        assert torch.equal(episodes.length, expected.length), name
        for field, values in vars(expected.goals).items():
            found = getattr(episodes.goals, field)
            assert torch.equal(found.nan_to_num(), values.nan_to_num()), (name, field)
    assert len(flown["oracle"]) == 6 and flown["oracle"].success.all()


def test_random_actions_differ_with_the_seed():
    lengths = []
    for seed in (5, 6):
        env = DroneEnv(4, TASK, pixels=False, seed=seed)
        source = env.side_streams(torch.tensor([0]), 5)[0]
        lengths.append(int(source.integers(2**63)))
        flown = run_baselines(4, TASK, env.state_dict(), 4)
        assert torch.equal(
            flown["random"].length, run_baselines(4, TASK, env.state_dict(), 4)["random"].length
        )
    assert lengths[0] != lengths[1]


def test_another_task_has_luck_of_its_own():
    env = DroneEnv(4, Posts(), pixels=False, seed=5)
    flown = run_baselines(4, Posts(), env.state_dict(), 8)
    assert tuple(flown) == ("random", "forward", "oracle")
    assert flown["oracle"].success.all() and flown["forward"].success.all()
    assert flown["random"].success.mean() < 0.5


def test_luck_flies_at_full_speed_where_speeds_are_asked_for():
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


def test_a_task_without_an_oracle_says_so_in_one_line():
    class Blind(Posts):
        name, oracle = "fog", None

    env = DroneEnv(2, Blind(), pixels=False)
    with pytest.raises(InputError, match="task=fog has no oracle; choose a task that has one"):
        run_baselines(2, Blind(), env.state_dict(), 2)


def test_a_baseline_that_is_no_action_of_the_drones_is_refused():
    actions = SimpleNamespace(names=("throttle", "pitch"))
    with pytest.raises(InputError, match=r"baseline=forward of task=.* which have throttle, pitch"):
        make_baseline("forward", TASK, torch.Generator(), actions)


def test_an_oracle_flies_no_dynamics_that_it_does_not_know():
    actions = SimpleNamespace(names=("throttle", "pitch"))
    with pytest.raises(InputError, match="acts by forward, left, right, these drones by throttle"):
        oracle_policy(TASK, actions)
