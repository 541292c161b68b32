"""TorchRL's collector steps one episode of each environment."""

import gc

import pytest
import torch
from tensordict.nn import probabilistic
from torchrl.envs.utils import ExplorationType, set_exploration_type

from drone_rl.collectors.episodes import SteppingCollector
from drone_rl.config import TaskSettings
from drone_rl.envs import DroneEnv, GrayPixels, with_transforms
from drone_rl.envs.direct_renderer import Reasons
from drone_rl.policies import SmallCNN, make_actor

TASK = TaskSettings(num_cubes=2, first_distance=3.0, spacing=3.0, step_limit=12, front_margin=3.0)
KEPT = [("next", name) for name in ("reward", "done", "terminated", "truncated")]


def make(num_envs=5, **settings):
    env = with_transforms(DroneEnv(num_envs, TASK), [GrayPixels()])
    generator = torch.Generator().manual_seed(0)
    network = SmallCNN((1, 25, 64), 3, channels=(4,), hidden=(8,), generator=generator)
    actor = make_actor(network, env.action_spec, generator)
    return SteppingCollector(env, actor, Reasons(["a reason"]), next_keys=KEPT, **settings), env


def test_construction_starts_no_episode():
    env = DroneEnv(5, TASK)
    assert torch.equal(make()[0].collect(5)["pixels"][0], GrayPixels()(env.reset())["pixels"][0])


def test_deleting_the_collector_keeps_the_environment_open():
    collector, env = make()
    collector.collect(5)
    del collector
    gc.collect()
    assert not env.is_closed
    env.reset()
    env.close()


@pytest.mark.parametrize("num_envs", [5, 2])
def test_every_episode_is_complete_and_starts_once(num_envs):
    collector, env = make()
    started, start = [], env.base_env.start
    env.base_env.start = lambda rows=None: started.append(len(rows)) or start(rows)
    for _ in range(2):
        batch = collector.collect(num_envs)
        ids, done = batch["collector", "traj_ids"], batch["next", "done"][:, 0]
        assert ids.unique().tolist() == list(range(num_envs))
        assert torch.equal(done, ids != torch.cat([ids[1:], torch.tensor([-1])]))
    assert started == [5, 5]


def test_outer_exploration_type_is_respected():
    collector, _ = make()
    with set_exploration_type(ExplorationType.DETERMINISTIC):
        batch = collector.collect(5)
    assert torch.equal(batch["action"], batch["logits"].argmax(-1))
    batch = collector.collect(5)
    assert not torch.equal(batch["action"], batch["logits"].argmax(-1))


def test_no_other_exploration_type_is_set_for_other_threads(monkeypatch):
    collector, _ = make()
    with set_exploration_type(ExplorationType.DETERMINISTIC):
        kinds, set_mode = set(), probabilistic._interaction_type.set_mode
        monkeypatch.setattr(
            probabilistic._interaction_type, "set_mode", lambda k: (kinds.add(k), set_mode(k))
        )
        collector.collect(5)
        assert kinds == {ExplorationType.DETERMINISTIC}
