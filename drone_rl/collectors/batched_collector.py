"""Base class of the collectors of one batch of environments."""

import abc
from collections.abc import Callable, Iterable, Iterator
from typing import Any, TypedDict, cast

from tensordict import TensorDict, TensorDictBase
from tensordict.nn import TensorDictModuleBase
from tensordict.utils import NestedKey
from torch import Tensor, nn
from torchrl.collectors import BaseCollector
from torchrl.envs import EnvBase

from drone_rl.envs import base_env
from drone_rl.utils.errors import InputError


class BatchOptions(TypedDict, total=False):
    """Keyword arguments of `BatchedCollector`."""

    total_frames: int
    next_keys: Iterable[NestedKey]
    postproc: Callable[[TensorDictBase], TensorDictBase] | None


class BatchedCollector(BaseCollector):
    """Iterates over batches from a batched environment and an actor, in this process."""

    def __init__(
        self,
        env: EnvBase,
        actor: TensorDictModuleBase,
        *,
        total_frames: int = -1,
        next_keys: Iterable[NestedKey] = (("next", "info", "end_reason"),),
        postproc: Callable[[TensorDictBase], TensorDictBase] | None = None,
    ) -> None:
        """Connect an environment and a policy.

        Args:
            env: A batch of environments; an `InputError` for any other.
            actor: Writes the action.
            total_frames: Stop before a batch once this many frames were collected; -1 for never.
            next_keys: ("next", ...) entries to keep in addition to reward and end flags, as far as
                the environment has them.
            postproc: Applied to each batch, such as a return estimator.
        """
        if len(env.batch_size) != 1:
            raise InputError(
                f"env has batch size {list(env.batch_size)}; give one with one batch dimension"
            )
        super().__init__()
        self.env = env
        self.actor = actor
        self.postproc = postproc
        self.total_frames = total_frames
        self.frames = 0
        self.episodes = 0
        self._observed = tuple(actor.in_keys)
        flags = (env.reward_key, *env.done_keys)
        observable = {
            ("next", *((key,) if isinstance(key, str) else key))
            for key in env.observation_spec.keys(True, True)
        }
        self._kept = (*(("next", key) for key in flags), *(k for k in next_keys if k in observable))

    @property
    def base_env(self) -> Any:
        """The environment without its transforms."""
        return base_env(self.env)

    @abc.abstractmethod
    def collect(self) -> TensorDictBase:
        """Return the next batch."""

    def iterator(self) -> Iterator[TensorDictBase]:
        """Yield batches until `total_frames`; a `for` over the collector calls it."""
        while self.total_frames < 0 or self.frames < self.total_frames:
            yield self.collect()

    def _finish(self, batch: TensorDictBase, episodes: int) -> TensorDictBase:
        """Count a batch and apply `postproc`."""
        self.frames += batch.numel()
        self.episodes += episodes
        return batch if self.postproc is None else self.postproc(batch)

    def set_seed(self, seed: int, static_seed: bool = False) -> int:
        """Seed the environments, not the actor's generator; return the next seed."""
        return cast(int, self.env.set_seed(seed, static_seed=static_seed))

    def shutdown(
        self, timeout: float | None = None, close_env: bool = True, raise_on_error: bool = True
    ) -> None:
        """Close the environment, unless it is to stay open."""
        if close_env and not self.env.is_closed:
            self.env.close()

    def __len__(self) -> int:
        """Raise a TypeError: the number of batches is not known."""
        raise TypeError(f"the number of batches of {type(self).__name__} is not known beforehand")

    def _maybe_fallback_update(
        self, policy_or_weights: Any = None, *, model_id: str | None = None
    ) -> None:
        """Copy the weights of an actor, or given ones; called by `update_policy_weights_`."""
        if policy_or_weights is None:
            return
        if isinstance(policy_or_weights, TensorDictBase):
            weights = cast(TensorDictBase, TensorDict.from_module(self.actor))
            weights.data.update_(policy_or_weights.data)
            return
        is_module = isinstance(policy_or_weights, nn.Module)
        self.actor.load_state_dict(
            policy_or_weights.state_dict() if is_module else policy_or_weights
        )


def take_rows(tensordict: TensorDictBase, rows: Tensor) -> TensorDictBase:
    """Index the first dimension by rows (k,), faster than tensordict's own indexing."""
    taken = {key: tensordict.get(key).index_select(0, rows) for key in tensordict.keys(True, True)}
    return TensorDict(taken, [len(rows)], device=tensordict.device)
