"""Collectors and networks are accelerated as far as that is supported."""

from torchrl.envs import RewardSum

from drone_rl.acceleration import (
    DirectCollector,
    DirectStepper,
    FusedCollector,
)
from drone_rl.collectors import speedups
from drone_rl.config import TaskSettings
from drone_rl.envs import DroneEnv, GrayPixels, with_transforms
from drone_rl.policies import MLP, SmallCNN, make_actor

TASK = TaskSettings(num_cubes=1, first_distance=3.0, step_limit=5)
KEPT = [("next", "reward"), ("next", "done")]


def test_collector_is_fused_direct_or_rejected_with_reasons():
    env = with_transforms(DroneEnv(2, TASK), [GrayPixels()])
    actor = make_actor(SmallCNN((1, 25, 64), 3), env.action_spec)
    find = speedups.accelerated_collector
    assert isinstance(find(env, actor, "fused", next_keys=KEPT), FusedCollector)
    assert isinstance(find(env, actor, "direct", next_keys=KEPT), DirectCollector)
    found = find(env, make_actor(MLP((1, 25, 64), 3), env.action_spec), "fused", next_keys=KEPT)
    assert isinstance(found, DirectCollector) and found.reasons == ("network MLP is not fused",)
    assert isinstance(speedups.accelerated_stepper(env, ["pixels"], KEPT), DirectStepper)
    summed = with_transforms(DroneEnv(2, TASK), [GrayPixels(), RewardSum()])
    reasons = ("transform RewardSum is not fused",)
    assert (
        find(summed, make_actor(SmallCNN((1, 25, 64), 3), env.action_spec), "fused", next_keys=KEPT)
        == reasons
    )
    assert speedups.accelerated_stepper(summed, ["pixels"], KEPT) == reasons
    env.close()
    summed.close()
