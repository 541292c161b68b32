# pyright: reportArgumentType=false
# pyright: reportIncompatibleMethodOverride=false
# (torch.cat takes TensorDicts, which its annotation lacks.)
"""Several collectors side by side on the threads of one process."""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import torch
from tensordict import TensorDictBase
from tensordict.nn import TensorDictModuleBase
from torchrl.collectors import BaseCollector

from drone_rl.acceleration.fused_network import ActivationCache
from drone_rl.collectors.worlds_collector import WorldsCollector


class ThreadedCollector(BaseCollector):
    """Joins the batches of collectors that run at the same time, each on a thread of its own.

    Drawing lets go of the interpreter's lock, so while one collector's worlds are being drawn
    another's policy acts: on a CPU that is the best use of its cores. Each collector has worlds
    and a stream of actions of its own, and their batches are joined in order, so the result does
    not depend on which thread is faster.
    """

    def __init__(
        self,
        collectors: Sequence[WorldsCollector],
        *,
        postproc: Callable[[TensorDictBase], TensorDictBase] | None = None,
    ) -> None:
        """Takes over the collectors.

        Args:
            collectors: Over disjoint worlds, each drawn by a single shard.
            postproc: Applied to each joined batch, such as a return estimator.
        """
        super().__init__()
        self.postproc = postproc
        self.collectors = list(collectors)
        # one torch thread each: the collectors are what runs in parallel
        self._pool = ThreadPoolExecutor(
            len(self.collectors), "collect", initializer=torch.set_num_threads, initargs=(1,)
        )

    @property
    def actor(self) -> TensorDictModuleBase:
        """The policy that learns."""
        return self.collectors[0].actor

    def cache_activations(self) -> ActivationCache | None:
        """See `WorldsCollector`; None where batches are joined, whose pictures are copies."""
        return self.collectors[0].cache_activations() if len(self.collectors) == 1 else None

    def iterator(self) -> Iterator[TensorDictBase]:
        """Yields batches without end; what a `for` over the collector goes through."""
        while True:
            yield self.collect()

    def collect(self) -> TensorDictBase:
        """What the collectors give, one after the other along the first dimension."""
        parts = list(self._pool.map(lambda collector: collector.collect(), self.collectors))
        batch = parts[0] if len(parts) == 1 else torch.cat(parts)
        return batch if self.postproc is None else self.postproc(batch)

    def state_dict(self) -> dict:
        """The collectors' states, as they stand between two batches."""
        return {"collectors": [collector.state_dict() for collector in self.collectors]}

    def load_state_dict(self, state_dict: dict) -> None:
        """Goes on from a `state_dict`."""
        for collector, part in zip(self.collectors, state_dict["collectors"], strict=True):
            collector.load_state_dict(part)

    def set_seed(self, seed: int, static_seed: bool = False) -> int:
        """Seeds all worlds, each of which has a stream of its own by its number.

        Returns:
            See `WorldsCollector.set_seed`.
        """
        return [c.set_seed(seed, static_seed=static_seed) for c in self.collectors][-1]

    def shutdown(
        self, timeout: float | None = None, close_env: bool = True, raise_on_error: bool = True
    ) -> None:
        """Ends the threads and closes the environments, unless they shall stay open."""
        self._pool.shutdown()
        for collector in self.collectors:
            collector.shutdown(close_env=close_env)

    def __len__(self) -> int:
        """There is no end of batches."""
        raise TypeError("a ThreadedCollector has batches without end")

    def _maybe_fallback_update(
        self, policy_or_weights: Any = None, *, model_id: str | None = None
    ) -> None:
        """What `update_policy_weights_` does, see `WorldsCollector`."""
        for collector in self.collectors:
            collector.update_policy_weights_(policy_or_weights)
