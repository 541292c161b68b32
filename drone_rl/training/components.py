"""Components of a training run, which its collectors and learners share."""

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import torch
from torchrl.envs import EnvBase

from drone_rl.config.learning import Episodes, Ray
from drone_rl.config.training import TrainSettings
from drone_rl.policies import ImageNetwork
from drone_rl.policies.zoo import describe
from drone_rl.sim.rendering.devices import check_device
from drone_rl.sim.tasks import FailureReplayTask
from drone_rl.utils.available_memory import require_memory
from drone_rl.utils.errors import InputError


class EnvGroup(NamedTuple):
    """The environments of one thread or worker, with the policy."""

    env: EnvBase
    actor: Any
    network: ImageNetwork
    """Shared by all groups."""
    generator: torch.Generator
    """Random stream of the actions."""


class Components(NamedTuple):
    """The collector of batches with returns, and the network that learns from them."""

    collector: Any
    """Has `actor` and `postproc`, in addition to what `Trainer` needs."""
    network: ImageNetwork
    generators: dict[str, torch.Generator]
    """Random streams of this process, by name."""
    activations: Any = None
    """`FusedEpisodes.activations`, if a fused collector alone makes the batches."""


def joined(collector: Any, groups: Sequence[EnvGroup]) -> Components:
    """Return the components of a training run whose groups are in this process."""
    generators = {f"actions_{i}": group.generator for i, group in enumerate(groups)}
    return Components(collector, groups[0].network, generators)


def group_sizes(settings: TrainSettings) -> list[int]:
    """Return the number of environments of each thread or worker; on a GPU there is one thread."""
    chosen = settings.collector
    has_one_group = settings.device.startswith("cuda") and not isinstance(chosen, Ray)
    groups = 1 if has_one_group else min(chosen.num_envs, chosen.num_threads)
    return [chosen.num_envs // groups + (i < chosen.num_envs % groups) for i in range(groups)]


def episode_options(settings: TrainSettings, num_threads: int) -> dict[str, Any]:
    """Return the arguments of `EpisodeCollector`; a fused kernel uses `num_threads`."""
    chosen = settings.collector
    fused = isinstance(chosen, Episodes) and chosen.compiled
    return {"compiled": fused, "num_threads": num_threads}


def make_collector(settings: TrainSettings, replay: FailureReplayTask | None = None) -> Components:
    """Make the collector of the settings, with environments and an untrained network.

    Raises:
        InputError: There is no such device, or an extra isn't installed.
    """
    check_device(settings.device)
    if not settings.device.startswith("cuda"):
        _require_batch(settings)
    return settings.collector.make(settings, replay)  # by default `train.threaded_collector`


def _require_batch(settings: TrainSettings) -> None:
    """Raise an `InputError` unless a batch of frames fits into memory.

    Complete episodes count a quarter of the longest one, which untrained policies reach on average.
    """
    chosen, frame = settings.collector, describe(settings).input
    longest = getattr(settings.task, "step_limit", 1)
    steps = getattr(settings.objective, "num_steps", max(1, longest // 4))
    needed = chosen.num_envs * steps * math.prod(frame.shape) * (4 if frame.is_float else 1)
    setting = f"collector.num_envs={chosen.num_envs}, batches of about {steps} steps of each,"
    require_memory(needed, setting, "give fewer environments, steps or pixels")


def make_learner(settings: TrainSettings, components: Components) -> Any:
    """Make the learner; raise an `InputError` if no policy could be read from its state."""
    learner = settings.objective.make(settings, components)
    saved = learner.state_dict().get("policy")
    if not isinstance(saved, Mapping) or saved.keys() != components.network.state_dict().keys():
        raise InputError(
            f"objective={settings.objective.name}: state_dict of {type(learner).__name__} lacks "
            'the policy\'s weights; add "policy": components.network.state_dict()'
        )
    return learner
