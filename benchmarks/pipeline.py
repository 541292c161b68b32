"""Components of the default pipeline, and functions that measure their speed."""

import statistics
import time
from collections.abc import Callable

import torch
from torchrl.envs import EnvBase
from torchrl.modules import ProbabilisticActor

from drone_rl.collectors import ThreadedCollector
from drone_rl.config import (
    COMPUTER_VISION,
    AppearanceSettings,
    CameraSettings,
    DynamicsSettings,
    TaskSettings,
)
from drone_rl.config.learning import Episodes
from drone_rl.config.training import TrainSettings
from drone_rl.envs import DroneEnv
from drone_rl.policies import PolicyNetwork, SmallCNN, make_actor
from drone_rl.policies.environment import make_env
from drone_rl.sim.rendering import RendererFactory
from drone_rl.training.train import make_collector


def default_collector(
    num_envs: int, device: str, dynamics: DynamicsSettings = COMPUTER_VISION
) -> ThreadedCollector:
    """Return the collector of `drone-rl train` with an untrained policy."""
    settings = TrainSettings(
        collector=Episodes(num_envs=num_envs), device=device, dynamics=dynamics
    )
    collector = make_collector(settings).collector
    assert isinstance(collector, ThreadedCollector)
    return collector


def default_pipeline(num_envs: int) -> tuple[EnvBase, ProbabilisticActor, PolicyNetwork]:
    """Return an environment with transforms, an actor with an untrained policy, and its network."""
    env = make_env(num_envs)
    shape = tuple(env.observation_spec["pixels"].shape[1:])
    network = SmallCNN(shape, 3, hidden=(128,), generator=torch.Generator().manual_seed(0))
    return env, make_actor(network, env.action_spec, torch.Generator().manual_seed(0)), network


def random_walk(env: DroneEnv, steps: int, seed: int = 0) -> int:
    """Step a batch with random actions and automatic resets; return the number of frames."""
    generator = torch.Generator(env.device).manual_seed(seed)
    state = env.reset()
    for _ in range(steps):
        action = torch.randint(3, env.batch_size, generator=generator, device=env.device)
        _, state = env.step_and_maybe_reset(state.set("action", action))
    return steps * env.batch_size[0]


def make_drone_env(
    num_envs: int,
    device: str,
    num_cubes: int = 3,
    renderer: str | RendererFactory = "raytrace",
    camera: CameraSettings | None = None,
    appearance: AppearanceSettings | None = None,
) -> DroneEnv:
    """Return an environment without transforms."""
    task = TaskSettings(num_cubes=num_cubes)
    return DroneEnv(num_envs, task, camera, device=device, renderer=renderer, appearance=appearance)


def rate(work: Callable[[], int], seconds: float) -> float:
    """Repeat some work until the time is up; return the items per second.

    Args:
        work: Function that returns the number of items that it processed.
        seconds: Minimum duration.
    """
    count, begin = 0, time.perf_counter()
    while time.perf_counter() - begin < seconds:
        count += work()
    return count / (time.perf_counter() - begin)


def paired(
    first: Callable[[], int], second: Callable[[], int], seconds: float, rounds: int
) -> tuple[float, float, float]:
    """Measure two functions alternately, so that a drift of the machine's speed affects both.

    Args:
        first: Function that returns the number of items that it processed.
        second: Function to compare with.
        seconds: Minimum duration of each measurement.
        rounds: Number of measurements of each.

    Returns:
        The median rate of each (items per second) and the median of the ratios first / second.
    """
    rates = [(rate(first, seconds), rate(second, seconds)) for _ in range(rounds)]
    return (
        statistics.median(a for a, _ in rates),
        statistics.median(b for _, b in rates),
        statistics.median(a / b for a, b in rates),
    )
