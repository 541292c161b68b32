"""Rollouts that continue across batches, compared with hand-computed ones and with TorchRL."""

import copy

import pytest
import torch
from tensordict import TensorDict
from tensordict.nn import TensorDictModule
from torchrl.envs import CatFrames, RewardSum, StepCounter

from drone_rl.collectors import RolloutCollector
from drone_rl.config import TaskSettings
from drone_rl.envs import DroneEnv, GrayPixels, with_transforms
from drone_rl.policies import MLP, make_actor
from drone_rl.training.restore import check_fits
from drone_rl.utils.errors import InputError
from tests.collectors.test_episodes import Scripted

SHORT = TaskSettings(num_cubes=2, first_distance=3.0, spacing=3.0, step_limit=10, front_margin=3.0)


class Endless(Scripted):
    """A `Scripted` environment that resets only masked episodes and repeats its lengths."""

    LENGTHS = tuple(lengths * 9 for lengths in Scripted.LENGTHS)

    def _reset(self, tensordict=None, **kwargs):
        mask = torch.ones(3, 1).bool() if tensordict is None else tensordict["_reset"]
        begun = mask[:, 0]
        self.episode = self.episode + begun.long()
        self.step_of = torch.where(begun, 0, self.step_of)
        return TensorDict({"frame": self._frame(), "done": torch.zeros(3, 1).bool()}, [3])


def scripted(num_steps=4, **kwargs):
    """Return a collector whose actor returns the frame number; the reward is minus that."""
    actor = TensorDictModule(lambda f: f[:, 0].long(), in_keys=["frame"], out_keys=["action"])
    return RolloutCollector(Endless(), actor, num_steps, **kwargs)


def test_rows_match_hand_computed_frames():
    """Environment 2 has episodes of 2 and 5 steps; the batch ends within the second."""
    collector = scripted()
    first, second = collector.collect(), collector.collect()
    assert first.shape == second.shape == (3, 4)
    frames = [batch["frame"][2, :, 0].tolist() for batch in (first, second)]
    assert frames == [[200, 201, 210, 211], [212, 213, 214, 220]]
    assert first["action"][2].tolist() == frames[0]
    seen = [batch["next", "frame"][2, :, 0].tolist() for batch in (first, second)]
    assert seen == [[201, 202, 211, 212], [213, 214, 215, 221]]  # 202: not the new episode yet
    assert first["next", "done"][2, :, 0].tolist() == [False, True, False, False]
    assert second["next", "done"][2, :, 0].tolist() == [False, False, True, True]
    totals = [batch["next", "episode_reward"][2, :, 0].tolist() for batch in (first, second)]
    assert totals == [[-200, -401, -210, -421], [-633, -846, -1060, -220]]
    counts = [batch["next", "step_count"][2, :, 0].tolist() for batch in (first, second)]
    assert counts == [[1, 2, 1, 2], [3, 4, 5, 1]]
    ends = [int(batch["next", "done"].sum()) for batch in (first, second)]
    assert (collector.frames, collector.episodes) == (24, sum(ends))


@pytest.mark.parametrize("num_steps", [1, 2, 5, 8])
def test_rollouts_do_not_depend_on_batch_boundaries(num_steps):
    whole, parts = scripted(40).collect(), scripted(num_steps)
    joined = torch.cat([parts.collect() for _ in range(40 // num_steps)], 1)
    for key in whole.keys(True, True):
        assert torch.equal(whole[key], joined[key]), key


def pipeline(seed=0, num_envs=5):
    """Return an environment with stateful transforms: frame stack, reward sum and step counter."""
    steps = [GrayPixels(), CatFrames(2, -3, in_keys=["pixels"]), RewardSum(), StepCounter()]
    env = with_transforms(DroneEnv(num_envs, SHORT, seed=seed, num_shards=1), steps)
    network = MLP((2, 25, 64), 3, hidden=(4,), generator=torch.Generator().manual_seed(seed))
    torch.nn.init.normal_(network.layers[-1].weight, generator=torch.Generator().manual_seed(1))
    actions = torch.Generator().manual_seed(seed)
    return env, make_actor(network, env.action_spec, actions), actions


def test_rollouts_equal_stepping_by_torchrl():
    env, actor, _ = pipeline()
    collector = RolloutCollector(env, actor, 6)
    other, *_ = pipeline()
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
        assert torch.equal(part["collected"], other["collected"])
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


@pytest.mark.parametrize("num_steps", [0, -1])
def test_nonpositive_num_steps_raises(num_steps):
    with pytest.raises(InputError, match=f"num_steps={num_steps} is out of range; give 1 or more"):
        scripted(num_steps)
