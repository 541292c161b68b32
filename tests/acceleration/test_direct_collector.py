"""The direct collector and stepper equal TorchRL's bit for bit."""

import copy
import dataclasses

import pytest
import torch
from torchrl.envs import CatFrames, RewardSum

from drone_rl.acceleration import DirectStepper
from drone_rl.acceleration.direct_collector import DirectCollector
from drone_rl.collectors import EpisodeCollector, RolloutCollector
from drone_rl.collectors.episodes import SteppingCollector
from drone_rl.collectors.rollouts import TorchrlStepper
from drone_rl.collectors.speedups import accelerated_stepper
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
from drone_rl.envs.direct_renderer import DirectRenderer, Reasons
from drone_rl.policies import SmallCNN, make_actor
from drone_rl.policies.baselines import make_baseline
from tests.continuous import make_env as make_continuous_env
from tests.continuous import make_policy

SHORT = TaskSettings(num_cubes=2, first_distance=3.0, spacing=3.0, step_limit=12, front_margin=3.0)
EIGHT = dataclasses.replace(SHORT, step_limit=8)
KEPT = [("next", name) for name in ("reward", "done", "terminated", "truncated")]
LOOK = AppearanceSettings(fog_visibility=(5.0, 50.0), ground_texture=("none", "grid"), shadows=0.5)
STACK = CatFrames(2, dim=-3, in_keys=["pixels"])
REASON = ("next", "info", "end_reason")


def make_env(*transforms, task=SHORT, **kwargs):
    return with_transforms(DroneEnv(5, task, **kwargs), transforms)


def collector(acceleration, task, next_keys=(REASON,), look=None):
    env = make_env(GrayPixels(), StandardizePixels(), task=task, appearance=look)
    generator = torch.Generator().manual_seed(0)
    shape = tuple(env.observation_spec["pixels"].shape[1:])
    network = SmallCNN(shape, 3, channels=(4,), hidden=(8,), generator=generator)
    actor = make_actor(network, env.action_spec, generator)
    made = EpisodeCollector(env, actor, next_keys=next_keys, acceleration=acceleration)
    is_stepping = isinstance(made.source, SteppingCollector)
    assert is_stepping is (acceleration == "none")
    return made


@pytest.mark.parametrize(
    ("task", "worlds", "look"),
    [
        *((SHORT, None, LOOK), (SHORT, 3, None), (EIGHT, 3, None)),
        *((PillarsSettings(num_rows=1), None, None), (PillarsSettings(num_rows=1), 3, LOOK)),
    ],
)
def test_direct_and_stepping_batches_are_identical(task, worlds, look):
    next_keys = (REASON, ("next", "info", "drone"))
    collectors = [collector(how, task, next_keys, look) for how in ("direct", "none")]
    lengths = set()
    for count in (worlds, None, worlds):  # random streams continue identically
        one, other = (each.collect(count) for each in collectors)
        assert set(one.keys(True, True)) == set(other.keys(True, True))
        for key in one.keys(True, True):
            assert torch.equal(one[key], other[key]), key
        first = one["collector", "traj_ids"].min()
        lengths |= {*torch.bincount(one["collector", "traj_ids"] - first).tolist()}
    assert len(lengths) > 1 or task is not SHORT  # some environments finish first


def test_continuous_actions_of_direct_and_stepping_batches_are_identical():
    collectors = []
    for acceleration in ("fused", "none"):
        env = make_continuous_env(5)
        actor = make_policy(env)[1]
        made = EpisodeCollector(env, actor, next_keys=(REASON,), acceleration=acceleration)
        is_direct = isinstance(made.source, DirectCollector)
        assert is_direct is (acceleration == "fused")
        collectors.append(made)
    for _ in range(2):
        one, other = (each.collect() for each in collectors)
        assert one["action"].shape == (len(one), 3) and one["action"].dtype == torch.float32
        for key in ("action", REASON, ("next", "reward"), ("collector", "traj_ids")):
            assert torch.equal(one[key], other[key]), key
    for each in collectors:
        each.shutdown()


def reasons(env, observed, kept):
    found = DirectRenderer.try_create(env, observed, kept)
    env.close()
    return str(found) if isinstance(found, Reasons) else ""


@pytest.mark.parametrize(
    ("transforms", "options", "observed", "kept", "reason"),
    [
        ([STACK], {}, ["pixels"], [], "transform CatFrames is not fused"),
        ([RewardSum()], {}, ["pixels"], [], "transform RewardSum is not fused"),
        ([Noise(), StandardizePixels()], {}, ["pixels"], [], "transform Noise is not fused"),
        ([LateFrames()], {}, ["pixels"], [], "transform LateFrames is not fused"),
        ([GrayPixels(out_keys=["gray"])], {}, ["gray"], [], "transform GrayPixels is not fused"),
        ([], {}, ["pixels", "hidden"], [], "the policy reads hidden"),
        ([], {}, [("info", "wind")], [], "the policy reads ('info', 'wind')"),
        (
            [],
            {},
            ["pixels"],
            [("next", "pixels")],
            "entry ('next', 'pixels') needs a step of TorchRL",
        ),
        (None, {"pixels": False}, ["pixels"], [], "the environment renders no pixels"),
    ],
)
def test_unsupported_environments_are_stepped_by_torchrl(
    transforms, options, observed, kept, reason
):
    first = [] if transforms is None or "gray" in observed else [GrayPixels()]
    env = make_env(*first, *(transforms or []), **options)
    assert reason in reasons(env, observed, [*KEPT, *kept])


def test_per_pixel_transforms_are_supported():
    transforms = (GrayPixels(), CropRows(5, 25), Blur(), StandardizePixels())
    assert not reasons(make_env(*transforms), ["pixels"], [*KEPT, REASON])


def test_a_subclass_of_the_environment_is_stepped_by_torchrl():
    class Windy(DroneEnv):
        pass

    env = with_transforms(Windy(2, SHORT), [GrayPixels()])
    assert "environment Windy is not a DroneEnv" in reasons(env, ["pixels"], KEPT)


@pytest.mark.parametrize("name", ["oracle", "random", "left"])
def test_policies_that_read_the_true_state_are_supported(name):
    batches = []
    for acceleration in ("direct", "none"):
        env = DroneEnv(3, SHORT, seed=5, pixels=False)
        actor = make_baseline(name, env.worlds.task, torch.Generator().manual_seed(3))
        collector = EpisodeCollector(
            env, actor, next_keys=KEPT, keep_actor_entries=False, acceleration=acceleration
        )
        assert collector.source.name.startswith("direct" if acceleration == "direct" else "step")
        batches.append(collector.collect())
        collector.shutdown()
    direct, stepped = batches
    assert set(direct.keys(True, True)) == set(stepped.keys(True, True))
    if name != "random":  # the stepping collector also samples actions of finished environments
        for key in direct.keys(True, True):
            assert torch.equal(direct[key], stepped[key]), key


def rollout_collector(is_direct, task, next_keys=(("next", "info", "end_reason"),), look=None):
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
    collectors = [rollout_collector(is_direct, task, next_keys)[0] for is_direct in (True, False)]
    for _ in range(4):
        one, other = (made.collect() for made in collectors)
        check_same(one, other)
    assert collectors[0].episodes == collectors[1].episodes > 3


@pytest.mark.parametrize("saved", [True, False])
@pytest.mark.parametrize("loaded", [True, False])
@pytest.mark.parametrize("look", [None, AppearanceSettings(fog_visibility=(5.0, 50.0))])
def test_direct_and_torchrl_steppers_exchange_states(saved, loaded, look):
    first, drawn = rollout_collector(saved, SHORT, look=look)
    first.collect()
    state, stream = copy.deepcopy(first.state_dict()), drawn.get_state()
    second, drawn = rollout_collector(loaded, SHORT, look=look)
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
