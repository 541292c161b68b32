# pyright: reportIncompatibleMethodOverride=false
# (TorchRL's collectors annotate states otherwise than they use them.)
"""Complete episodes, each frame once: what REINFORCE learns from."""

from collections.abc import Iterable
from typing import Any

import torch
from tensordict import TensorDict, TensorDictBase
from tensordict.nn import TensorDictModuleBase
from tensordict.utils import NestedKey
from torch import Tensor
from torchrl.envs import EnvBase

from drone_rl.acceleration.fused_collector import Flight
from drone_rl.acceleration.fused_network import ActivationCache
from drone_rl.collectors.ways import StraightWay, find_way
from drone_rl.collectors.worlds_collector import WorldsCollector


class EpisodeCollector(WorldsCollector):
    """Iterates over batches of `env.batch_size[0]` complete episodes, one a world.

    A batch is in the "cat" format of TorchRL's `Collector(trajs_per_batch=...)`: a flat TensorDict
    of shape (T_total,), episode after episode without padding, marked by ("collector",
    "traj_ids"), each ending in ("next", "done"). Next observations are left out: no estimator
    without a critic needs them.

    All worlds start a batch together under one policy and each is left alone once its episode
    has ended, undrawn and free of cost. So a batch is strictly on-policy and has no bias towards
    short episodes, no frame is dropped or used twice, and between two batches no episode is under
    way: what is needed to resume is the worlds' random streams alone.
    """

    def __init__(
        self,
        env: EnvBase,
        actor: TensorDictModuleBase,
        *,
        keep_observations: bool = True,
        noted: Iterable[NestedKey] = (),
        is_compiled: bool = False,
        num_cores: int = 1,
        **kwargs: Any,
    ) -> None:
        """Connects an environment and a policy.

        Args:
            env: A batched environment that honours TorchRL's "_step" masks.
            actor: Writes the action.
            keep_observations: Whether to keep what the actor saw and made of it.
            noted: What the actor writes and is kept besides its actions, if observations are not.
            is_compiled: Whether a kernel may fly whole episodes, see `Flight`. It draws actions in
                another order, and sums in the network may differ in the last place.
            num_cores: That such a kernel takes; no result depends on it.
            kwargs: See `WorldsCollector`.

        Raises:
            InputError: The environment is not a batch of worlds.
        """
        super().__init__(env, actor, **kwargs)
        self._keep_observations, self._noted = keep_observations, tuple(noted)
        self._way = find_way(env, self._observed, self._kept)
        self._flight = None
        if is_compiled and isinstance(self._way, StraightWay):
            self._flight = Flight.find(self._way.sight, actor, num_cores)

    @property
    def implementation(self) -> str:
        """What computes the actions: "fused kernel" or "PyTorch"."""
        return "PyTorch" if self._flight is None else "fused kernel"

    @torch.no_grad()
    def collect(self, num_worlds: int | None = None) -> TensorDictBase:
        """Runs one episode in every world, or in the first `num_worlds`. Shape: (T_total,)."""
        count = self.env.batch_size[0]
        flying = count if num_worlds is None else min(num_worlds, count)
        if self._flight is not None and self._flight.can_act():
            batch = self._flight.fly(flying, self._keep_observations)
        else:
            batch = self._step_by_step(flying)
        batch["collector", "traj_ids"] += self.episodes
        return self._finish(batch, flying)

    def _step_by_step(self, flying: int) -> TensorDictBase:
        indices = torch.arange(flying, device=self.env.device)
        worlds: list[Tensor] = []
        steps: list[dict[NestedKey, Tensor]] = []
        seen = self._way.begin(indices)
        while len(indices):
            acted = self.actor(seen)
            keys = (self.env.action_key, *self._noted)
            keys = acted.keys(True, True) if self._keep_observations else keys
            step = {key: acted.get(key) for key in keys}
            after, seen = self._way.step(indices, acted.get(self.env.action_key))
            worlds.append(indices)
            steps.append(step | after)
            indices = indices[~after["next", "done"].flatten()]
        return _join(steps, worlds, flying)

    def cache_activations(self) -> ActivationCache | None:
        """See `WorldsCollector`."""
        return None if self._flight is None else self._flight.cache_activations()

    def shutdown(
        self, timeout: float | None = None, close_env: bool = True, raise_on_error: bool = True
    ) -> None:
        """See `WorldsCollector`."""
        if self._flight is not None:
            self._flight.close()
        super().shutdown(timeout, close_env, raise_on_error)

    def state_dict(self) -> dict:
        """Counters and the environment's random streams, as they stand between two batches."""
        worlds = self.worlds.state_dict()
        return {"frames": self.frames, "episodes": self.episodes, "worlds": worlds}

    def load_state_dict(self, state_dict: dict) -> None:
        """Goes on from a `state_dict`."""
        self.frames, self.episodes = state_dict["frames"], state_dict["episodes"]
        self.worlds.load_state_dict(state_dict["worlds"])


def _join(
    steps: list[dict[NestedKey, Tensor]], worlds: list[Tensor], num_worlds: int
) -> TensorDictBase:
    """Time-major steps to episode after episode, copying each frame once. Shape: (T_total,)."""
    worlds_of_steps = torch.cat(worlds)
    lengths = worlds_of_steps.bincount(minlength=num_worlds)
    first = lengths.cumsum(0) - lengths
    rows = torch.cat([first[indices] + t for t, indices in enumerate(worlds)])
    batch = TensorDict({}, [len(rows)], device=rows.device)
    spans = rows.split([len(indices) for indices in worlds])
    for key, value in steps[0].items():
        joined = value.new_empty(len(batch), *value.shape[1:])
        for indices, step in zip(spans, steps, strict=True):
            joined.index_copy_(0, indices, step[key])
        batch.set(key, joined)
    traj_ids = torch.empty_like(worlds_of_steps).index_copy_(0, rows, worlds_of_steps)
    return batch.set(("collector", "traj_ids"), traj_ids)
