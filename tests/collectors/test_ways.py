"""The straight way gives what steps of TorchRL give; it is not taken where it cannot."""

import pytest
import torch
from torchrl.envs import CatFrames, RewardSum

from drone_rl.collectors import EpisodeCollector
from drone_rl.collectors.ways import StraightWay, TorchrlWay, find_way
from drone_rl.config import AppearanceSettings, PillarsSettings, TaskSettings
from drone_rl.envs import (
    Blur,
    CropRows,
    DroneEnv,
    GrayPixels,
    LateFrames,
    Noise,
    StandardizePixels,
    with_transforms,
)
from drone_rl.policies import SmallCNN, make_actor
from tests.continuous import make_policy, make_worlds

SHORT = TaskSettings(num_cubes=2, first_distance=3.0, spacing=3.0, step_limit=12, front_margin=3.0)
KEPT = [("next", name) for name in ("reward", "done", "terminated", "truncated")]
LOOK = AppearanceSettings(fog_visibility=(5.0, 50.0), ground_texture=("none", "grid"), shadows=0.5)
REASON = ("next", "info", "end_reason")


def make_env(*transforms, task=SHORT, **kwargs):
    return with_transforms(DroneEnv(5, task, **kwargs), transforms)


def collector(is_straight, task, keep=(REASON,), look=None):
    env = make_env(GrayPixels(), StandardizePixels(), task=task, appearance=look)
    generator = torch.Generator().manual_seed(0)
    shape = tuple(env.observation_spec["pixels"].shape[1:])
    network = SmallCNN(shape, 3, channels=(4,), hidden=(8,), generator=generator)
    made = EpisodeCollector(env, make_actor(network, env.action_spec, generator), keep=keep)
    assert isinstance(made._way, StraightWay)
    if not is_straight:
        made._way = TorchrlWay(env, made._observed, made._kept)
    return made


@pytest.mark.parametrize("task", [SHORT, PillarsSettings(num_rows=1)])
@pytest.mark.parametrize("worlds", [None, 3])
@pytest.mark.parametrize("look", [None, LOOK])
def test_both_ways_give_the_same_bit_for_bit(task, worlds, look):
    keep = (REASON, ("next", "info", "drone"))
    ways = [collector(is_straight, task, keep, look) for is_straight in (True, False)]
    lengths = set()
    for _ in range(3):  # the streams of worlds and actions go on alike
        one, other = (way.collect(worlds) for way in ways)
        assert set(one.keys(True, True)) == set(other.keys(True, True))
        for key in one.keys(True, True):
            assert torch.equal(one[key], other[key]), key
        first = one["collector", "traj_ids"].min()
        lengths |= {*torch.bincount(one["collector", "traj_ids"] - first).tolist()}
    assert len(lengths) > 1 or task is not SHORT  # some went on alone


def test_both_ways_fly_at_speeds_that_are_drawn():
    ways = []
    for is_straight in (True, False):
        env = make_worlds(5)
        made = EpisodeCollector(env, make_policy(env)[1], keep=(REASON,), is_compiled=True)
        assert isinstance(made._way, StraightWay) and made._flight is None
        if not is_straight:
            made._way = TorchrlWay(env, made._observed, made._kept)
        ways.append(made)
    for _ in range(2):
        one, other = (way.collect() for way in ways)
        assert one["action"].shape == (len(one), 3) and one["action"].dtype == torch.float32
        for key in ("action", REASON, ("next", "reward"), ("collector", "traj_ids")):
            assert torch.equal(one[key], other[key]), key
    for way in ways:
        way.shutdown()


@pytest.mark.parametrize(
    ("transforms", "options", "observed", "kept"),
    [
        ([GrayPixels(), CatFrames(2, dim=-3, in_keys=["pixels"])], {}, ["pixels"], []),
        ([GrayPixels(), RewardSum()], {}, ["pixels"], []),
        ([GrayPixels(), Noise(), StandardizePixels()], {}, ["pixels"], []),
        ([GrayPixels(), LateFrames(), StandardizePixels()], {}, ["pixels"], []),
        ([GrayPixels(out_keys=["gray"])], {}, ["gray"], []),
        ([GrayPixels()], {}, ["pixels", ("info", "drone")], []),
        ([GrayPixels()], {}, ["pixels"], [("next", "pixels")]),
        ([], {"pixels": False}, [("info", "drone")], []),
    ],
)
def test_where_something_is_in_the_way_steps_are_torchrls(transforms, options, observed, kept):
    env = make_env(*transforms, **options)
    assert isinstance(find_way(env, observed, [*KEPT, *kept]), TorchrlWay)
    env.close()


def test_maps_from_picture_to_picture_are_in_nobodys_way():
    env = make_env(GrayPixels(), CropRows(5, 25), Blur(), StandardizePixels())
    assert isinstance(find_way(env, ["pixels"], [*KEPT, REASON]), StraightWay)
    assert isinstance(find_way(env.base_env, ["pixels"], KEPT), TorchrlWay)
    env.close()


def test_an_environment_of_another_kind_may_have_steps_of_its_own():
    class Windy(DroneEnv):
        pass

    env = with_transforms(Windy(2, SHORT), [GrayPixels()])
    assert isinstance(find_way(env, ["pixels"], KEPT), TorchrlWay)
    env.close()
