"""The direct stepper equals TorchRL's steps bit for bit."""

import copy

import pytest
import torch
from torchrl.envs import CatFrames

from drone_rl.acceleration import DirectStepper
from drone_rl.collectors import RolloutCollector
from drone_rl.collectors.rollouts import TorchrlStepper
from drone_rl.collectors.speedups import accelerated_stepper
from drone_rl.config import AppearanceSettings, PillarsSettings, TaskSettings
from drone_rl.envs import DroneEnv, GrayPixels, StandardizePixels, with_transforms
from drone_rl.envs.direct_renderer import STEP_NAMES, Reasons
from drone_rl.policies import SmallCNN, make_actor

SHORT = TaskSettings(num_cubes=2, first_distance=3.0, spacing=3.0, step_limit=12, front_margin=3.0)
KEPT = [("next", name) for name in STEP_NAMES]


def collector(is_direct, task, next_keys=(("next", "info", "end_reason"),), look=None):
    env = with_transforms(DroneEnv(5, task, appearance=look), [GrayPixels(), StandardizePixels()])
    generator = torch.Generator().manual_seed(0)
    shape = tuple(env.observation_spec["pixels"].shape[1:])
    network = SmallCNN(shape, 3, channels=(4,), hidden=(8,), generator=generator)
    actor = make_actor(network, env.action_spec, generator)
    made = RolloutCollector(env, actor, 9, next_keys=next_keys)
    assert isinstance(made._stepper, DirectStepper)
    if not is_direct:
        made._stepper = TorchrlStepper(env, made._observed, made._kept, Reasons(["a test"]))
    return made, generator


def check_same(one, other):
    assert set(one.keys(True, True)) == set(other.keys(True, True))
    for key in one.keys(True, True):
        assert torch.equal(one[key], other[key]), key


@pytest.mark.parametrize("task", [SHORT, PillarsSettings(num_rows=1)])
def test_direct_and_torchrl_steppers_are_identical(task):
    next_keys = (("next", "info", "end_reason"), ("next", "info", "drone"))
    collectors = [collector(is_direct, task, next_keys)[0] for is_direct in (True, False)]
    for _ in range(4):
        one, other = (made.collect() for made in collectors)
        check_same(one, other)
    assert collectors[0].episodes == collectors[1].episodes > 3


@pytest.mark.parametrize("saved", [True, False])
@pytest.mark.parametrize("loaded", [True, False])
@pytest.mark.parametrize("look", [None, AppearanceSettings(fog_visibility=(5.0, 50.0))])
def test_direct_and_torchrl_steppers_exchange_states(saved, loaded, look):
    first, drawn = collector(saved, SHORT, look=look)
    first.collect()
    state, stream = copy.deepcopy(first.state_dict()), drawn.get_state()
    second, drawn = collector(loaded, SHORT, look=look)
    second.load_state_dict(state)
    drawn.set_state(stream)
    check_same(second.collect(), first.collect())


def test_stacked_frames_are_stepped_by_torchrl():
    env = with_transforms(DroneEnv(2, SHORT), [GrayPixels()])
    assert isinstance(accelerated_stepper(env, ["pixels"], KEPT), DirectStepper)
    env.close()
    stack = CatFrames(2, dim=-3, in_keys=["pixels"])
    env = with_transforms(DroneEnv(2, SHORT), [GrayPixels(), stack])
    reasons = accelerated_stepper(env, ["pixels"], KEPT)
    assert reasons == ("transform CatFrames is not fused",)
    env.close()
