"""Collects complete episodes from a batch of environments."""

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import torch
from tensordict import TensorDictBase
from tensordict.nn import TensorDictModuleBase
from tensordict.utils import NestedKey
from torchrl.envs import EnvBase

from drone_rl.collectors.batched_collector import BatchedCollector
from drone_rl.collectors.speedups import Acceleration, accelerated_collector
from drone_rl.collectors.stepping import SteppingCollector
from drone_rl.envs.direct_renderer import Reasons

if TYPE_CHECKING:
    from drone_rl.acceleration import DirectCollector, FusedCollector


class EpisodeCollector(BatchedCollector):
    """Iterates over batches of `env.batch_size[0]` complete episodes, one an environment.

    A batch is in the "cat" format of TorchRL's `Collector(trajs_per_batch=...)`: a flat TensorDict
    of shape (T_total,), episode after episode without padding, numbered by ("collector",
    "traj_ids"), each ending in ("next", "done"). Next observations are left out: no estimator
    without a critic needs them.

    All environments reset at the start of a batch. An environment whose episode has ended is masked
    until the batch ends and is not rendered. So a batch is on-policy and not biased towards short
    episodes, no frame is dropped or used twice, and no episode is under way between two batches:
    the state to resume from is the environments' random streams.
    """

    def __init__(
        self,
        env: EnvBase,
        actor: TensorDictModuleBase,
        *,
        keep_observations: bool = True,
        noted: Iterable[NestedKey] = (),
        acceleration: Acceleration = "direct",
        num_threads: int = 1,
        **kwargs: Any,
    ) -> None:
        """Connects an environment and a policy.

        Args:
            env: A batched environment that honours TorchRL's "_step" masks.
            actor: Writes the action.
            keep_observations: Whether to keep what the actor reads and writes.
            noted: Entries that the actor writes, kept even without observations.
            acceleration: The fastest implementation that may be used, if it supports environment
                and actor.
            num_threads: Of the fused kernel; no result depends on it.
            kwargs: See `BatchedCollector`.

        Raises:
            InputError: The environment is not a batch of environments.
        """
        super().__init__(env, actor, **kwargs)
        what = {"kept": self._kept, "extra": noted, "keep_observations": keep_observations}
        found = accelerated_collector(env, actor, acceleration, num_threads=num_threads, **what)
        self.source: FusedCollector | DirectCollector | SteppingCollector = (
            SteppingCollector(env, actor, found, **what) if isinstance(found, Reasons) else found
        )
        """What runs the episodes."""

    @torch.no_grad()
    def collect(self, num_envs: int | None = None) -> TensorDictBase:
        """Run an episode in every environment, or in the first `num_envs`. Shape: (T_total,)."""
        size = self.env.batch_size[0]
        count = size if num_envs is None else min(num_envs, size)
        batch = self.source.collect(count)
        batch["collector", "traj_ids"] += self.episodes
        return self._finish(batch, count)

    def shutdown(
        self, timeout: float | None = None, close_env: bool = True, raise_on_error: bool = True
    ) -> None:
        """See `BatchedCollector`."""
        self.source.close()
        super().shutdown(timeout, close_env, raise_on_error)

    def state_dict(self) -> dict[str, Any]:  # pyright: ignore[reportIncompatibleMethodOverride]
        """Counters and the environments' random streams between two batches."""
        worlds = self.base_env.state_dict()
        return {"frames": self.frames, "episodes": self.episodes, "worlds": worlds}

    def load_state_dict(self, state_dict: dict[str, Any]) -> None:
        """Resumes from a `state_dict`."""
        self.frames, self.episodes = state_dict["frames"], state_dict["episodes"]
        self.base_env.load_state_dict(state_dict["worlds"])
