"""Behavior common to both collectors (TorchRL's interface), and collectors in threads."""

import copy
import itertools

import pytest
import torch
from tensordict import TensorDict
from tensordict.nn import TensorDictModule
from torchrl.collectors import BaseCollector

from drone_rl.collectors import EpisodeCollector, RolloutCollector, ThreadedCollector
from drone_rl.config import TaskSettings
from drone_rl.envs import DroneEnv
from drone_rl.policies.baselines import OracleAgent
from tests.collectors.test_episodes import SHORT

TASK = TaskSettings(num_cubes=1, first_distance=3.0, step_limit=12, front_margin=3.0)
KINDS = {
    "episodes": EpisodeCollector,
    "rollouts": lambda env, actor, **kwargs: RolloutCollector(env, actor, 5, **kwargs),
}


@pytest.fixture(params=KINDS.values(), ids=KINDS)
def make(request):
    """Return a factory of collectors of each kind, without rendering."""

    def build(actor=None, **kwargs):
        return request.param(DroneEnv(3, TASK, pixels=False), actor or OracleAgent(), **kwargs)

    return build


def test_implements_the_torchrl_collector_interface(make):
    collector = make()
    assert isinstance(collector, BaseCollector)
    assert torch.equal(collector.next()["action"], make().collect()["action"])
    assert collector.pre_collect_hook is None and collector.post_collect_hook is None
    with pytest.raises(TypeError, match="not known beforehand"):
        len(collector)


def test_stops_at_total_frames(make):
    frames = [batch.numel() for batch in itertools.islice(make(), 3)]
    assert [batch.numel() for batch in make(total_frames=0)] == []
    assert [batch.numel() for batch in make(total_frames=frames[0])] == frames[:1]
    assert [batch.numel() for batch in make(total_frames=frames[0] + 1)] == frames[:2]


def test_set_seed_seeds_the_environments(make):
    collector = make(info=("cube_positions",))
    first = collector.collect()["next", "info", "cube_positions"]
    assert collector.set_seed(0, static_seed=True) == 0
    assert torch.equal(collector.collect()["next", "info", "cube_positions"], first)
    assert collector.set_seed(7) != 7  # the seed for the next collector
    assert not torch.equal(collector.collect()["next", "info", "cube_positions"][0], first[0])


def test_update_weights_accepts_actor_state_dict_or_tensordict(make):
    layer = torch.nn.Linear(1, 1)
    actor = TensorDictModule(layer, in_keys=["frame"], out_keys=["action"])
    collector = make(actor)
    before = layer.weight.detach().clone()
    collector.update_policy_weights_()
    assert torch.equal(layer.weight, before)
    for value, kind in enumerate((lambda a: a, lambda a: a.state_dict(), TensorDict.from_module)):
        other = copy.deepcopy(actor)
        torch.nn.init.constant_(other.module.weight, value)
        collector.update_policy_weights_(kind(other))
        assert float(layer.weight.detach()) == value
        assert layer.weight is collector.actor.module.weight  # updated in place


def test_shutdown_can_leave_the_environment_open(make):
    collector = make()
    collector.collect()
    collector.shutdown(close_env=False)
    assert not collector.env.is_closed
    collector.shutdown()
    assert collector.env.is_closed


def threaded(make_pipeline):
    shares = [make_pipeline(2, task=SHORT, first_world=i * 2, num_shards=1) for i in range(2)]
    return ThreadedCollector([EpisodeCollector(*share) for share in shares])


def test_threaded_batches_are_deterministic(make_pipeline):
    first, second = threaded(make_pipeline), threaded(make_pipeline)
    for _ in range(3):
        one, two = first.collect(), second.collect()
        assert torch.equal(one["pixels"], two["pixels"])
        assert torch.equal(one["action"], two["action"])
    first.shutdown()
    second.shutdown()


def test_threaded_state_round_trip(make_pipeline):
    first = threaded(make_pipeline)
    first.collect()
    state = first.state_dict()
    second = threaded(make_pipeline)
    second.load_state_dict(state)
    assert second.state_dict() == state
    for one, two in zip(first.collectors, second.collectors, strict=True):
        cubes = [c.env.reset()["info", "cube_positions"] for c in (one, two)]
        assert torch.equal(*cubes)
    assert second.collectors[0].frames == first.collectors[0].frames
    first.shutdown()
    second.shutdown()
