"""Collects complete episodes from a batch of environments."""

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, Unpack

import torch
from tensordict import TensorDictBase
from tensordict.nn import TensorDictModuleBase
from tensordict.utils import NestedKey
from torch import Tensor
from torchrl.envs import EnvBase

from drone_rl.collectors.batched_collector import BatchedCollector, BatchOptions, take_rows
from drone_rl.collectors.speedups import Acceleration, accelerated_collector
from drone_rl.envs.direct_renderer import Reasons

if TYPE_CHECKING:
    from drone_rl.acceleration import DirectCollector, FusedCollector


class EpisodeCollector(BatchedCollector):
    """Iterate over batches of `env.batch_size[0]` complete episodes, one for each environment.

    A batch is in the "cat" format of TorchRL's `Collector(trajs_per_batch=...)`: a flat TensorDict
    of shape (T_total,), episode after episode without padding, numbered by ("collector",
    "traj_ids"), each ending in ("next", "done"). Next observations are left out: only
    estimators with a critic need them.

    All environments reset at the start of a batch. An environment whose episode has ended is masked
    until the batch ends and is not rendered. So a batch is on-policy and not biased towards short
    episodes, and between batches the environments' random streams are the whole state.
    """

    def __init__(
        self,
        env: EnvBase,
        actor: TensorDictModuleBase,
        *,
        keep_actor_entries: bool = True,
        actor_keys: Iterable[NestedKey] = (),
        acceleration: Acceleration = "direct",
        num_threads: int = 1,
        **options: Unpack[BatchOptions],
    ) -> None:
        """Connect an environment and a policy.

        Args:
            env: A batch of environments that honours TorchRL's "_step" masks.
            actor: Writes the action.
            keep_actor_entries: Whether to keep all entries that the actor reads and writes.
            actor_keys: Entries that the actor reads or writes, to keep in addition to the action.
            acceleration: The fastest implementation that may be used, if it is supported.
            num_threads: Of the fused kernel; no result depends on it.
            options: See `BatchedCollector`, also for errors.
        """
        super().__init__(env, actor, **options)
        entries: dict[str, Any] = {"next_keys": self._kept, "actor_keys": actor_keys}
        entries["keep_actor_entries"] = keep_actor_entries
        source = accelerated_collector(env, actor, acceleration, num_threads=num_threads, **entries)
        self.source: FusedCollector | DirectCollector | SteppingCollector = (
            SteppingCollector(env, actor, source, **entries)
            if isinstance(source, Reasons)
            else source
        )
        """Implementation that runs the episodes."""

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
        """Return counters and the environments' random streams between two batches."""
        worlds = self.base_env.state_dict()
        return {"frames": self.frames, "episodes": self.episodes, "worlds": worlds}

    def load_state_dict(self, state_dict: dict[str, Any]) -> None:
        """Resume from a `state_dict`."""
        self.frames, self.episodes = state_dict["frames"], state_dict["episodes"]
        self.base_env.load_state_dict(state_dict["worlds"])


class SteppingCollector:
    """Collect one complete episode of each environment by `env.step`.

    TorchRL's `Collector(trajs_per_batch=...)` takes the episodes that end first, which biases a
    batch towards short ones.
    """

    implementation = "PyTorch"

    def __init__(
        self,
        env: EnvBase,
        actor: TensorDictModuleBase,
        reasons: Reasons,
        *,
        next_keys: Iterable[NestedKey],
        actor_keys: Iterable[NestedKey] = (),
        keep_actor_entries: bool = True,
    ) -> None:
        """See `accelerated_collector`; the reasons are why there is no faster collector."""
        self.name = f"stepping collector: {reasons}"
        """Name in the log."""
        self._env, self._actor = env, actor
        self._kept = (env.action_key, *next_keys, *actor_keys)
        self._keep_actor_entries = keep_actor_entries

    def collect(self, num_envs: int) -> TensorDictBase:
        """Run an episode in each of the first environments; traj_ids are 0 to num_envs - 1."""
        state = self._env.reset()
        active = torch.arange(len(state), device=state.device) < num_envs
        steps: list[TensorDictBase] = []
        masks: list[Tensor] = []
        while bool(active.any()):
            rows = active.nonzero()[:, 0]
            acted = self._actor(take_rows(state.select(*self._actor.in_keys), rows))
            for key, value in acted.exclude(*self._actor.in_keys).items(True, True):
                blank = value.new_zeros(len(active), *value.shape[1:])
                state.set(key, blank.index_copy(0, rows, value))
            if len(rows) < len(active):
                state.set("_step", active)
            state = self._env.step(state)
            keys = acted.keys(True, True) if self._keep_actor_entries else ()
            steps.append(state.select(*self._kept, *keys))
            masks.append(active)
            active = active & ~state.get(("next", "done")).flatten()
            state = self._env.step_mdp(state)
        mask = torch.stack(masks, 1)
        batch: Any = torch.stack(steps, 1)  # pyright: ignore[reportArgumentType]
        batch = batch[mask]  # row-major: environment after environment, step after step
        return batch.set(("collector", "traj_ids"), mask.nonzero()[:, 0])

    def close(self) -> None:
        """Do nothing: the caller closes the environment."""
