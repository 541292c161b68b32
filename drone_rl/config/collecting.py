"""How batches are collected, and on what."""

import dataclasses
from typing import Annotated, ClassVar

from drone_rl.config.variant import Variant
from drone_rl.utils.schema import Real, Whole


@dataclasses.dataclass(frozen=True, kw_only=True)
class Collector(Variant):
    """Which workers, and how many."""

    num_envs: Annotated[int, Whole(1, unit="worlds")] = 16
    """Worlds, each with one episode in a batch, or with as many steps as the others."""
    num_threads: Annotated[int, Whole(1, unit="threads")] = 1
    """Groups of worlds collected at the same time, each on a thread or worker of its own. Each
    draws its actions from its own stream: this is part of what a seed means."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Episodes(Collector):
    """Batches of complete episodes."""

    compiled: bool = True
    """Whether whole episodes are flown by one compiled kernel, where task, pictures and network are
    such as it knows: many times as fast on a CPU. It draws its actions in another order, so this is
    part of what a seed means."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Threads(Episodes):
    """Batches of complete episodes from threads of this process."""

    target: ClassVar[str] = "drone_rl.training.build_collector.threaded_collector"


@dataclasses.dataclass(frozen=True, kw_only=True)
class Ray(Episodes):
    """Batches of complete episodes from workers on a Ray cluster."""

    target: ClassVar[str] = "drone_rl.training.build_collector.ray_collector"
    num_threads: Annotated[int, Whole(1, unit="workers")] = 2
    """Workers, each with its share of the worlds and a stream of actions of its own: this is part
    of what a seed means."""
    address: str | None = None
    """Of the cluster, such as auto or ray://host:10001; none starts one on this machine."""
    num_cpus: Annotated[float, Real(0.0, is_above=True, unit="cores")] = 1.0
    """Cores that a worker takes of the cluster."""
    max_lost_workers: Annotated[int, Whole(0, unit="workers")] = 10
    """Workers that may be lost, and replaced, before training stops."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Rollouts(Collector):
    """Batches of the next steps of each world, with what was seen after them, from threads.

    How many steps is the objective's business. Episodes go on from one batch to the next.
    """

    target: ClassVar[str] = "drone_rl.training.build_collector.rollout_collector"
    num_envs: Annotated[int, Whole(1, unit="worlds")] = 64
    """Worlds."""
