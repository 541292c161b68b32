"""The straight stream gives what TorchRL's steps give; it is not taken where it cannot."""

import copy

import pytest
import torch
from torchrl.envs import CatFrames

from drone_rl.collectors import RolloutCollector
from drone_rl.collectors.streams import StraightStream, TorchrlStream, find_stream
from drone_rl.config import AppearanceSettings, PillarsSettings, TaskSettings
from drone_rl.envs import DroneEnv, GrayPixels, StandardizePixels, with_transforms
from drone_rl.envs.direct_renderer import FLAGS
from drone_rl.policies import SmallCNN, make_actor

SHORT = TaskSettings(num_cubes=2, first_distance=3.0, spacing=3.0, step_limit=12, front_margin=3.0)
KEPT = [("next", name) for name in FLAGS]


def collector(is_straight, task, keep=(("next", "info", "end_reason"),), look=None):
    env = with_transforms(DroneEnv(5, task, appearance=look), [GrayPixels(), StandardizePixels()])
    generator = torch.Generator().manual_seed(0)
    shape = tuple(env.observation_spec["pixels"].shape[1:])
    network = SmallCNN(shape, 3, channels=(4,), hidden=(8,), generator=generator)
    actor = make_actor(network, env.action_spec, generator)
    made = RolloutCollector(env, actor, 9, keep=keep)
    assert isinstance(made._way, StraightStream)
    if not is_straight:
        made._way = TorchrlStream(env, made._observed, made._kept)
    return made, generator


def check_same(one, other):
    assert set(one.keys(True, True)) == set(other.keys(True, True))
    for key in one.keys(True, True):
        assert torch.equal(one[key], other[key]), key


@pytest.mark.parametrize("task", [SHORT, PillarsSettings(num_rows=1)])
def test_both_streams_give_the_same_bit_for_bit(task):
    keep = (("next", "info", "end_reason"), ("next", "info", "drone"))
    streams = [collector(is_straight, task, keep)[0] for is_straight in (True, False)]
    for _ in range(4):
        one, other = (stream.collect() for stream in streams)
        check_same(one, other)
    assert streams[0].episodes == streams[1].episodes > 3


@pytest.mark.parametrize("saved", [True, False])
@pytest.mark.parametrize("loaded", [True, False])
@pytest.mark.parametrize("look", [None, AppearanceSettings(fog_visibility=(5.0, 50.0))])
def test_either_goes_on_with_what_the_other_left(saved, loaded, look):
    first, drawn = collector(saved, SHORT, look=look)
    first.collect()
    state, stream = copy.deepcopy(first.state_dict()), drawn.get_state()
    second, drawn = collector(loaded, SHORT, look=look)
    second.load_state_dict(state)
    drawn.set_state(stream)
    check_same(second.collect(), first.collect())


def test_where_frames_are_stacked_steps_are_torchrls():
    env = with_transforms(DroneEnv(2, SHORT), [GrayPixels()])
    assert isinstance(find_stream(env, ["pixels"], KEPT), StraightStream)
    env.close()
    stack = CatFrames(2, dim=-3, in_keys=["pixels"])
    env = with_transforms(DroneEnv(2, SHORT), [GrayPixels(), stack])
    assert isinstance(find_stream(env, ["pixels"], KEPT), TorchrlStream)
    env.close()
