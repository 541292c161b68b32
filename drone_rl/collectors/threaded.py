"""Several collectors side by side on the threads of one process."""

from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor

import torch
from tensordict import TensorDictBase
from tensordict.nn import TensorDictModuleBase

from drone_rl.collectors.episodes import EpisodeCollector


class ThreadedCollector:
    """Joins the batches of collectors that run at the same time, each on a thread of its own.

    Drawing lets go of the interpreter's lock, so while one collector's worlds are being drawn
    another's policy acts: on a CPU that is the best use of its cores. Each collector has worlds
    and a stream of actions of its own, and their batches are joined in order, so the result does
    not depend on which thread is faster.
    """

    def __init__(self, collectors: Sequence[EpisodeCollector]) -> None:
        """Takes over the collectors.

        Args:
            collectors: Over disjoint worlds, each drawn by a single shard.
        """
        self.collectors = list(collectors)
        # one torch thread each: the collectors are what runs in parallel
        self._pool = ThreadPoolExecutor(
            len(self.collectors), "collect", initializer=torch.set_num_threads, initargs=(1,)
        )

    @property
    def actor(self) -> TensorDictModuleBase:
        """The policy that learns."""
        return self.collectors[0].actor

    def __iter__(self) -> Iterator[TensorDictBase]:
        """Yields batches without end."""
        while True:
            yield self.collect()

    def collect(self) -> TensorDictBase:
        """Runs one episode in every world of every collector. Shape: (T_total,)."""
        parts = list(self._pool.map(EpisodeCollector.collect, self.collectors))
        return parts[0] if len(parts) == 1 else torch.cat(parts)

    def state_dict(self) -> dict:
        """The collectors' states, as they stand between two batches."""
        return {"collectors": [collector.state_dict() for collector in self.collectors]}

    def load_state_dict(self, state: dict) -> None:
        """Goes on from a `state_dict`."""
        for collector, part in zip(self.collectors, state["collectors"], strict=True):
            collector.load_state_dict(part)

    def shutdown(self) -> None:
        """Ends the threads and closes the environments."""
        self._pool.shutdown()
        for collector in self.collectors:
            collector.shutdown()
