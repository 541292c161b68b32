"""Collects complete episodes from a batch of environments."""

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, Unpack

import torch
from tensordict import TensorDictBase
from tensordict.nn import TensorDictModuleBase
from tensordict.utils import NestedKey
from torch import Tensor
from torchrl.collectors import Collector
from torchrl.envs import Compose, EnvBase, TransformedEnv
from torchrl.envs.utils import exploration_type

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


_STEPS = 8
"""Steps of one call of TorchRL's collector; an episode may span several calls."""


class SteppingCollector:
    """Collect one complete episode of each environment with TorchRL's `Collector`.

    TorchRL's `trajs_per_batch` takes the episodes that end first, which biases a batch towards
    short ones. Here an environment whose episode has ended is masked until all have ended.
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
        self.reasons = reasons
        self._env = _OneEpisode(env)
        self._actor = _ActiveOnly(actor, self._env)
        self._kept = (env.action_key, *next_keys, *actor_keys)
        self._keep_actor_entries = keep_actor_entries
        self._collector = Collector(
            self._env,
            self._actor,
            frames_per_batch=env.batch_size[0] * _STEPS,
            use_buffers=False,
            track_traj_ids=False,
            trust_policy=True,
            auto_register_policy_transforms=False,
        )

    @property
    def name(self) -> str:
        """Name in the log."""
        return f"stepping collector: {self.reasons}"

    def collect(self, num_envs: int) -> TensorDictBase:
        """Run an episode in each of the first environments; traj_ids are 0 to num_envs - 1."""
        self._env.num_envs = num_envs
        # The caller's type: the collector sets it for the whole process, also for other threads.
        self._collector.exploration_type = exploration_type()
        self._collector.reset_at_each_iter = True
        rollouts = []
        while self._collector.reset_at_each_iter or bool(self._env.active.any()):
            rollout = self._collector.rollout()
            self._collector.reset_at_each_iter = False
            keys = {*self._kept, *(self._actor.keys if self._keep_actor_entries else ())}
            rollouts.append(rollout.select(*keys))
        # a lazy stack is slow to index
        steps: Any = torch.cat(rollouts, 1).contiguous()  # (batch_size, T)
        mask = torch.stack(self._env.masks, 1)
        batch = steps[mask]  # row-major: environment after environment, step after step
        return batch.set(("collector", "traj_ids"), mask.nonzero()[:, 0])

    def close(self) -> None:
        """Do nothing: the caller closes the environment."""


class _OneEpisode(TransformedEnv):
    """Runs one episode after each reset; an environment whose episode has ended is frozen."""

    def __init__(self, env: EnvBase) -> None:
        super().__init__(env, Compose(), auto_unwrap=False)  # pyright: ignore[reportCallIssue]
        self.num_envs = 0
        """How many environments run, from the first on; 0 until there is something to collect."""
        self.active = torch.zeros(env.batch_size, dtype=torch.bool, device=env.device)
        """Whether an environment's episode is under way. Shape: (batch_size,)."""
        self.masks: list[Tensor] = []
        """Which environments took each step since the last reset. Shapes: (batch_size,)."""

    def _reset(self, tensordict: TensorDictBase | None = None, **kwargs: Any) -> TensorDictBase:
        self.active = torch.arange(len(self.active), device=self.active.device) < self.num_envs
        self.masks = []
        if not self.num_envs:  # TorchRL's collector resets when it is made; that samples no episode
            return self.fake_tensordict().exclude("next", *self.action_keys)
        return super()._reset(tensordict, **kwargs)

    def close(self, *, raise_if_closed: bool = True) -> None:
        """Leave the environment open: TorchRL's collector closes its own when it is deleted."""

    def step_and_maybe_reset(
        self, tensordict: TensorDictBase
    ) -> tuple[TensorDictBase, TensorDictBase]:
        """Step the environments whose episodes are under way; reset none."""
        self.masks.append(self.active)
        if not bool(self.active.all()):
            tensordict.set("_step", self.active)
        tensordict = self.step(tensordict)
        following = self.step_mdp(tensordict)
        self.active = self.active & ~tensordict.get(("next", "done")).flatten()
        return tensordict, following


class _ActiveOnly(TensorDictModuleBase):
    """Evaluates an actor on the environments whose episodes are under way."""

    def __init__(self, actor: Any, env: _OneEpisode) -> None:
        super().__init__()
        self.in_keys, self.out_keys = actor.in_keys, actor.out_keys
        self.keys: set[NestedKey] = set()
        """Entries that the actor reads and writes."""
        self._actor = [actor]  # in a list: its parameters are not this module's
        self._env = [env]
        self._blank: dict[NestedKey, Tensor] = {}

    def forward(self, tensordict: TensorDictBase) -> TensorDictBase:
        """Evaluate the actor on active environments; write 0 for the others."""
        active = self._env[0].active
        rows = active.nonzero()[:, 0]
        if not len(rows):
            return tensordict.update(self._blank)
        observed = tensordict.select(*self.in_keys)
        acted = self._actor[0](take_rows(observed, rows))
        self.keys = set(acted.keys(True, True))
        for key in self.keys - set(observed.keys(True, True)):
            value = acted.get(key)
            self._blank[key] = value.new_zeros(len(active), *value.shape[1:])
            tensordict.set(key, self._blank[key].index_copy(0, rows, value))
        return tensordict
