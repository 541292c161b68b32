"""A training's worlds shared out to workers, with the network that all of them fly by."""

import functools
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

import torch

from drone_rl.collectors import (
    BatchedCollector,
    EpisodeCollector,
    RolloutCollector,
    ThreadedCollector,
)
from drone_rl.config.configuration import as_config, from_config
from drone_rl.config.learning import Episodes, Ray, Rollouts, Threads, WithCritic
from drone_rl.config.registry import implements
from drone_rl.config.training import TrainSettings
from drone_rl.policies import PolicyNetwork, make_actor
from drone_rl.policies.zoo import describe
from drone_rl.sim.tasks import FailureReplayTask
from drone_rl.utils.provenance import num_cores
from drone_rl.utils.seeding import Stream, torch_generator

if TYPE_CHECKING:
    from drone_rl.collectors.ray import RayEpisodeCollector

C = TypeVar("C", bound=BatchedCollector)


class Collecting(NamedTuple):
    """What a training collects with."""

    collector: "ThreadedCollector | RayEpisodeCollector"
    network: PolicyNetwork
    generators: dict[str, torch.Generator]
    """Random streams of this process, by name."""


def build_collector(
    settings: TrainSettings, practice: FailureReplayTask | None = None
) -> Collecting:
    """The collector that the settings ask for, over worlds that fly by an untrained network.

    Args:
        settings: The training's.
        practice: Where episodes begin, if not anywhere.

    Raises:
        InputError: There is no such device, or an extra isn't installed.
    """
    return settings.collector.make(settings, practice)


@implements(Threads)
def threaded_collector(
    settings: TrainSettings, practice: FailureReplayTask | None = None
) -> Collecting:
    """`Threads`: complete episodes from threads of this process."""
    cores = max(1, num_cores() // _num_workers(settings))
    return _threaded(settings, practice, _episodes(settings, cores))


@implements(Rollouts)
def rollout_collector(
    settings: TrainSettings, practice: FailureReplayTask | None = None
) -> Collecting:
    """`Rollouts`: the next steps of each world, from threads of this process."""
    objective = settings.objective
    assert isinstance(objective, WithCritic)
    collect = functools.partial(RolloutCollector, num_steps=objective.num_steps)
    return _threaded(settings, practice, collect)


def _threaded(
    settings: TrainSettings,
    practice: FailureReplayTask | None,
    collect: Callable[..., BatchedCollector],
) -> Collecting:
    """The worlds shared out to threads, each with a collector made of worlds and an actor."""
    shares = _shares(settings)
    network, collectors, generators = None, [], {}
    for i in range(len(shares)):
        collector, network, actions = build_share(
            settings, shares, i, network, practice, collect=collect
        )
        collectors.append(collector)
        generators[f"actions_{i}"] = actions
    assert network is not None  # there is at least one share
    return Collecting(ThreadedCollector(collectors), network, generators)


@implements(Ray)
def ray_collector(settings: TrainSettings, practice: FailureReplayTask | None = None) -> Collecting:
    """`Ray`: the workers are processes of a Ray cluster."""
    from drone_rl.collectors.ray import RayEpisodeCollector  # slow to import, seldom needed

    asked = settings.collector
    assert isinstance(asked, Ray)
    shares = _shares(settings)
    local, network, _ = build_share(settings, [1], 0, collect=EpisodeCollector)
    local.shutdown()
    config = as_config(settings)
    workers = range(len(shares))
    makers = [functools.partial(_remote_share, config, shares, i, practice) for i in workers]
    collector = RayEpisodeCollector(
        makers,
        local.actor,
        network,
        address=asked.address,
        num_cpus=asked.num_cpus,
        max_lost_workers=asked.max_lost_workers,
        device=settings.device,
    )
    return Collecting(collector, network, {})


def build_share(
    settings: TrainSettings,
    shares: list[int],
    number: int,
    network: PolicyNetwork | None = None,
    practice: FailureReplayTask | None = None,
    *,
    collect: Callable[..., C],
) -> tuple[C, PolicyNetwork, torch.Generator]:
    """One worker's worlds, with the network that all share, and the stream of its actions.

    Args:
        settings: The training's.
        shares: Worlds of each worker.
        number: Of this worker.
        network: That of the other workers; None makes it.
        practice: Where episodes begin, if not anywhere.
        collect: Makes a collector of worlds and an actor.
    """
    description, seed = describe(settings), settings.seed
    env = description.build_env(
        shares[number],
        seed=seed,
        device=settings.device,
        renderer=settings.renderer,
        task=practice,
        first_world=sum(shares[:number]),
        num_shards=1,
    )
    if network is None:
        network = description.build_network(torch_generator(seed, Stream.POLICY_INIT))
        network = network.to(settings.device)
    actions = torch_generator(seed, Stream.ACTIONS, number=number, device=settings.device)
    return collect(env, make_actor(network, env.action_spec, actions)), network, actions


def _remote_share(
    config: dict[str, Any], shares: list[int], number: int, practice: FailureReplayTask | None
) -> tuple[EpisodeCollector, PolicyNetwork, torch.Generator]:
    """`build_share` from what can be sent."""
    settings = from_config(TrainSettings, config)
    assert isinstance(settings.collector, Ray)
    collect = _episodes(settings, max(1, int(settings.collector.num_cpus)))
    return build_share(settings, shares, number, practice=practice, collect=collect)


def _episodes(settings: TrainSettings, cores: int) -> Callable[..., EpisodeCollector]:
    """Makes collectors of complete episodes, each on so many cores."""
    asked = settings.collector
    acceleration = "fused" if isinstance(asked, Episodes) and asked.compiled else "none"
    return functools.partial(EpisodeCollector, acceleration=acceleration, num_threads=cores)


def _num_workers(settings: TrainSettings) -> int:
    """How many share the worlds; threads would only wait for each other at a GPU."""
    asked = settings.collector
    is_one = settings.device.startswith("cuda") and not isinstance(asked, Ray)
    return 1 if is_one else min(asked.num_envs, asked.num_threads)


def _shares(settings: TrainSettings) -> list[int]:
    """Worlds of each worker."""
    worlds, workers = settings.collector.num_envs, _num_workers(settings)
    return [worlds // workers + (i < worlds % workers) for i in range(workers)]
