"""Rollouts that continue across batches, compared with TorchRL."""

import copy

import pytest
import torch
from torchrl.envs import CatFrames, Compose, RewardSum, StepCounter, TransformedEnv

from drone_rl.collectors import RolloutCollector
from drone_rl.config import TaskSettings
from drone_rl.envs import DroneEnv, GrayPixels
from drone_rl.policies import MLP, make_actor
from drone_rl.training.restore import check_fits
from drone_rl.utils.errors import InputError

SHORT = TaskSettings(num_cubes=2, first_distance=3.0, spacing=3.0, step_limit=10, front_margin=3.0)


SEEN = [GrayPixels(), CatFrames(2, -3, in_keys=["pixels"])]


def pipeline(seed=0, num_envs=5):
    """Return an environment with stateful transforms: frame stack, reward sum and step counter."""
    base = DroneEnv(num_envs, SHORT, seed=seed, num_shards=1, transforms=SEEN)
    env = TransformedEnv(base, Compose(RewardSum(), StepCounter()))
    network = MLP((2, 25, 64), 3, hidden=(4,), generator=torch.Generator().manual_seed(seed))
    torch.nn.init.normal_(network.layers[-1].weight, generator=torch.Generator().manual_seed(1))
    actions = torch.Generator().manual_seed(seed)
    return env, make_actor(network, env.action_spec, actions), actions


def test_rollouts_equal_stepping_by_torchrl():
    """Of bytes without transforms; TorchRL's own transforms make the observations."""
    env, actor, _ = pipeline()
    collector = RolloutCollector(env, actor, 6)
    plain = DroneEnv(5, SHORT, seed=0, num_shards=1)
    other = TransformedEnv(plain, Compose(*SEEN, RewardSum(), StepCounter()))
    state = other.reset()
    for batch in (collector.collect() for _ in range(5)):
        for t in range(6):
            assert torch.equal(batch["pixels"][:, t], state["pixels"])
            state["action"] = batch["action"][:, t]
            after, state = other.step_and_maybe_reset(state)
            for key in ("pixels", "reward", "done", "terminated", "truncated"):
                assert torch.equal(batch["next", key][:, t], after["next", key]), key
            for key in ("episode_reward", "step_count"):  # entries of the transforms
                assert torch.equal(batch["next", key][:, t], after["next", key]), key
    assert int(collector.episodes) > 10
    env.close()
    other.close()


def test_resuming_from_a_state_gives_the_same_rollouts():
    env, actor, actions = pipeline()
    first = RolloutCollector(env, actor, 6)
    first.collect()
    state, drawn = copy.deepcopy(first.state_dict()), actions.get_state()
    assert state["step_count"].any()  # episodes are running
    wanted = [first.collect() for _ in range(3)]
    env2, actor2, actions2 = pipeline(seed=7)
    actor2.load_state_dict(actor.state_dict())
    second = RolloutCollector(env2, actor2, 6)
    check_fits(state, second.state_dict(), "collector")
    second.load_state_dict(state)
    actions2.set_state(drawn)
    assert (second.frames, second.episodes) == (30, state["episodes"])
    for batch in wanted:
        found = second.collect()
        for key in batch.keys(True, True):
            assert torch.equal(found[key], batch[key]), key
    env.close()
    env2.close()


def test_state_is_a_copy():
    env, actor, _ = pipeline()
    collector = RolloutCollector(env, actor, 6)
    collector.collect()
    state = copy.deepcopy(collector.state_dict())
    collector.load_state_dict(state)
    kept = copy.deepcopy(state)
    collector.collect()
    assert all(torch.equal(state[k], kept[k]) for k in ("episode_reward", "step_count"))
    for part, other in ((state["worlds"]["worlds"], kept["worlds"]["worlds"]),):
        assert torch.equal(part["body"]["position"], other["body"]["position"])
        assert torch.equal(part["reached"], other["reached"])
    env.close()


def test_set_seed_restarts_all_episodes():
    env, actor, _ = pipeline()
    collector = RolloutCollector(env, actor, 6)
    first = collector.collect()["pixels"][:, 0]
    collector.set_seed(0, static_seed=True)
    again = collector.collect()
    assert torch.equal(again["pixels"][:, 0], first)
    assert again["next", "step_count"][:, 0].tolist() == [[1]] * 5
    env.close()


def test_rollouts_do_not_depend_on_batch_boundaries():
    env, actor, _ = pipeline()
    whole = RolloutCollector(env, actor, 24).collect()
    env2, actor2, _ = pipeline()
    parts = RolloutCollector(env2, actor2, 8)
    joined = torch.cat([parts.collect() for _ in range(3)], 1)
    for key in whole.keys(True, True):
        assert torch.equal(whole[key], joined[key]), key


@pytest.mark.parametrize("num_steps", [0, -1])
def test_nonpositive_num_steps_raises(num_steps):
    env, actor, _ = pipeline()
    with pytest.raises(InputError, match=f"num_steps={num_steps} is out of range; give 1 or more"):
        RolloutCollector(env, actor, num_steps)
    env.close()
