"""Parallel collectors give deterministic batches."""

import copy

import torch

from drone_rl.collectors import EpisodeCollector, ThreadedCollector
from tests.collectors.test_episodes import SHORT


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


def test_seed_and_weights_reach_every_collector(make_pipeline):
    joined = threaded(make_pipeline)
    first = joined.collect()
    assert joined.set_seed(0, static_seed=True) == 0
    cubes = [c.env.reset()["info", "cube_positions"] for c in joined.collectors]
    assert not torch.equal(*cubes)  # same seed, different environments
    other = copy.deepcopy(joined.actor)
    for parameter in other.parameters():
        torch.nn.init.zeros_(parameter)
    joined.update_policy_weights_(other)
    batch = joined.collect()
    assert not batch["logits"].any() and first["logits"].any()
    joined.shutdown()
    assert all(c.env.is_closed for c in joined.collectors)
