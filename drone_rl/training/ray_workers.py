"""Collecting by workers on a Ray cluster."""

import functools
from typing import Any

from drone_rl.collectors import EpisodeCollector
from drone_rl.config.learning import Ray
from drone_rl.config.registry import implements, modules_of
from drone_rl.config.training import TrainSettings
from drone_rl.sim.tasks import FailureReplayTask
from drone_rl.training.train import Components, group_sizes, make_groups
from drone_rl.utils.plugins import IMPORTED, import_plugin


@implements(Ray)
def ray_collector(settings: TrainSettings, replay: FailureReplayTask | None = None) -> Components:
    """Make `collector=ray`: complete episodes, with returns, from workers on a Ray cluster."""
    from drone_rl.collectors.ray import RayEpisodeCollector  # slow to import, seldom needed

    chosen = settings.collector
    assert isinstance(chosen, Ray)
    sizes = group_sizes(settings)
    ((env, actor),) = make_groups(settings, [1], 1)  # only the actor is needed
    env.close()
    sent = (settings.config(), [*IMPORTED, *sorted(modules_of(settings))], sizes)
    makers = [functools.partial(_remote_collector, *sent, i, replay) for i in range(len(sizes))]
    collector = RayEpisodeCollector(
        makers,
        actor,
        address=chosen.address,
        num_cpus=chosen.num_cpus,
        max_lost_workers=chosen.max_lost_workers,
        device=settings.device,
        postproc=settings.returns.make().to(settings.device),
    )
    return Components(collector, actor.network, {})


def _remote_collector(
    config: dict[str, Any],
    plugins: list[str],
    sizes: list[int],
    number: int,
    replay: FailureReplayTask | None,
) -> EpisodeCollector:
    """Make a worker's collector, from arguments that can be sent; `plugins` register its parts."""
    for plugin in plugins:
        import_plugin(plugin)
    settings = TrainSettings.read(config)
    chosen = settings.collector
    assert isinstance(chosen, Ray)
    cores = max(1, int(chosen.num_cpus))
    ((env, actor),) = make_groups(settings, sizes, cores, replay, [number])
    return EpisodeCollector(env, actor, compiled=chosen.compiled, num_threads=cores)
