"""Training whose collectors are workers on a Ray cluster."""

import functools
from typing import Any

import torch

from drone_rl.collectors import EpisodeCollector
from drone_rl.config.configuration import as_config, from_config
from drone_rl.config.learning import Ray
from drone_rl.config.registry import implements
from drone_rl.config.training import TrainSettings
from drone_rl.policies import PolicyNetwork
from drone_rl.sim.tasks import FailureReplayTask
from drone_rl.training.components import Components, episode_options, group_sizes
from drone_rl.training.train import make_groups


@implements(Ray)
def ray_collector(settings: TrainSettings, replay: FailureReplayTask | None = None) -> Components:
    """Make `collector=ray`: complete episodes, with returns, from workers on a Ray cluster."""
    from drone_rl.collectors.ray import RayEpisodeCollector  # slow to import, seldom needed

    asked = settings.collector
    assert isinstance(asked, Ray)
    sizes = group_sizes(settings)
    (local,) = make_groups(settings, [1])
    local.env.close()
    config = as_config(settings)
    workers = range(len(sizes))
    makers = [functools.partial(_remote_collector, config, sizes, i, replay) for i in workers]
    collector = RayEpisodeCollector(
        makers,
        local.actor,
        local.network,
        address=asked.address,
        num_cpus=asked.num_cpus,
        max_lost_workers=asked.max_lost_workers,
        device=settings.device,
        postproc=settings.returns.make().to(settings.device),
    )
    return Components(collector, local.network, {})


def _remote_collector(
    config: dict[str, Any], sizes: list[int], number: int, replay: FailureReplayTask | None
) -> tuple[EpisodeCollector, PolicyNetwork, torch.Generator]:
    """Make a worker's collector, from arguments that can be sent."""
    settings = from_config(TrainSettings, config)
    assert isinstance(settings.collector, Ray)
    (group,) = make_groups(settings, sizes, replay, [number])
    options = episode_options(settings, max(1, int(settings.collector.num_cpus)))
    collector = EpisodeCollector(group.env, group.actor, **options)
    return collector, group.network, group.generator
