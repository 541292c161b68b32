"""Runs several collectors in parallel threads of one process."""

import contextvars
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import torch
from tensordict import TensorDictBase
from tensordict.nn import TensorDictModuleBase
from torchrl.collectors import BaseCollector

from drone_rl.collectors.batched_collector import BatchedCollector
from drone_rl.utils.threads import set_torch_threads


class ThreadedCollector(BaseCollector):
    """Join the batches of collectors that run in parallel, each in its own thread.

    Rendering releases the interpreter's lock, so that one collector renders while the policy of
    another acts. Batches are joined in order, so the result does not depend on the threads' speed.
    """

    def __init__(
        self,
        collectors: Sequence[BatchedCollector],
        *,
        postproc: Callable[[TensorDictBase], TensorDictBase] | None = None,
    ) -> None:
        """Take over collectors of disjoint environments, each rendered by a single shard.

        `postproc` is applied to each joined batch, such as a return estimator.
        """
        super().__init__()
        self.postproc = postproc
        self.collectors = list(collectors)
        # one torch thread each: the collectors are what runs in parallel
        self._pool = ThreadPoolExecutor(
            len(self.collectors), "collect", initializer=set_torch_threads, initargs=(1,)
        )

    @property
    def actor(self) -> TensorDictModuleBase:
        """The policy that learns."""
        return self.collectors[0].actor

    def iterator(self) -> Iterator[TensorDictBase]:
        """Yield batches without end; a `for` over the collector calls it."""
        while True:
            yield self.collect()

    def collect(self) -> TensorDictBase:
        """Return the batches of the collectors, joined along the first dimension.

        ("collector", "traj_ids") are unique only within the part of one collector.
        """
        contexts = [contextvars.copy_context() for _ in self.collectors]  # as in the calling thread
        parts = list(self._pool.map(lambda c, at: at.run(c.collect), self.collectors, contexts))
        joined: Any = torch.cat  # its annotation lacks TensorDicts
        batch = parts[0] if len(parts) == 1 else joined(parts)
        return batch if self.postproc is None else self.postproc(batch)

    def state_dict(self) -> dict[str, Any]:  # pyright: ignore[reportIncompatibleMethodOverride]
        """Return the collectors' states between two batches."""
        return {"collectors": [collector.state_dict() for collector in self.collectors]}

    def load_state_dict(self, state_dict: dict[str, Any]) -> None:
        """Resume from a `state_dict`."""
        for collector, part in zip(self.collectors, state_dict["collectors"], strict=True):
            collector.load_state_dict(part)

    def set_seed(self, seed: int, static_seed: bool = False) -> int:
        """Seed all environments; return a seed for the next collector."""
        return [c.set_seed(seed, static_seed=static_seed) for c in self.collectors][-1]

    def shutdown(
        self, timeout: float | None = None, close_env: bool = True, raise_on_error: bool = True
    ) -> None:
        """End the threads and close the environments, unless they are to stay open."""
        self._pool.shutdown()
        for collector in self.collectors:
            collector.shutdown(close_env=close_env)

    def _maybe_fallback_update(
        self, policy_or_weights: Any = None, *, model_id: str | None = None
    ) -> None:
        """Implement `update_policy_weights_`, see `BatchedCollector`."""
        for collector in self.collectors:
            collector.update_policy_weights_(policy_or_weights)
