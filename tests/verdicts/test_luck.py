import pytest
import torch

from drone_rl.envs import DroneEnv
from drone_rl.evaluation import ConstantPolicy, Oracle, RandomPolicy, run_episodes
from drone_rl.sim.actions import Move
from drone_rl.sim.settings import TaskSettings
from drone_rl.sim.worlds import Worlds
from drone_rl.utils.seeding import Stream, torch_generator
from drone_rl.verdicts.luck import BASELINES, fly_baselines

TASK = TaskSettings(num_cubes=1)


@pytest.fixture
def policies():
    """What each baseline is; luck has a random stream of its own, which no policy's actions use."""
    generator = torch_generator(0, Stream.ACTIONS, number=1)
    fixed = {action.name.lower(): ConstantPolicy(action) for action in Move}
    return {"oracle": Oracle(TASK), "random": RandomPolicy(3, generator), **fixed}


def test_baselines_are_flown_in_the_same_worlds_one_by_one(policies, monkeypatch):
    monkeypatch.setattr(Worlds, "render", lambda *args: pytest.fail("nobody looks"))
    env = DroneEnv(4, TASK, pixels=False, seed=5)
    worlds = env.state_dict()
    flown = fly_baselines(4, TASK, worlds, 6)
    assert tuple(flown) == BASELINES and set(BASELINES) == set(policies)
    for name, episodes in flown.items():
        env.load_state_dict(worlds)
        expected = run_episodes(env, policies[name], 6)
        for field, values in vars(expected).items():
            assert torch.equal(getattr(episodes, field).nan_to_num(), values.nan_to_num()), name
    assert len(flown["oracle"]) == 6 and flown["oracle"].success.all()
