# pyright: reportAttributeAccessIssue=false
# pyright: reportIncompatibleMethodOverride=false
# pyright: reportReturnType=false
# (TorchRL's collectors annotate states and seeds otherwise than they use them.)
"""Complete episodes, each frame once: what REINFORCE learns from."""

from collections.abc import Callable, Iterator
from typing import Any, cast

import torch
from tensordict import TensorDict, TensorDictBase
from tensordict.nn import TensorDictModuleBase
from tensordict.utils import NestedKey
from torch import Tensor, nn
from torchrl.collectors import BaseCollector
from torchrl.envs import EnvBase

from drone_rl.utils.errors import InputError


class EpisodeCollector(BaseCollector):
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
        total_frames: int = -1,
        keep_observations: bool = True,
        keep: tuple = (("next", "info", "end_reason"),),
        postproc: Callable[[TensorDictBase], TensorDictBase] | None = None,
    ) -> None:
        """Connects an environment and a policy.

        Args:
            env: A batched environment that honours TorchRL's "_step" masks.
            actor: Writes the action.
            total_frames: Stop before a batch once this many frames were collected; -1 for never.
            keep_observations: Whether to keep what the actor saw and made of it.
            keep: Entries kept besides that, the action, the reward and the end flags, as far as
                the environment has them.
            postproc: Applied to each batch, such as a return estimator.

        Raises:
            InputError: The environment is not a batch of worlds.
        """
        if len(env.batch_size) != 1:
            raise InputError(f"env has batch size {list(env.batch_size)}; give a batch of worlds")
        super().__init__()
        self.env = env
        self.actor = actor
        self.postproc = postproc
        self.total_frames = total_frames
        self.frames = 0
        self.episodes = 0
        self._observed = tuple(actor.in_keys)
        self._keep_observations = keep_observations
        flags = (env.reward_key, *env.done_keys)
        observable = {("next", *_as_tuple(key)) for key in env.observation_spec.keys(True, True)}
        self._kept = (*(("next", key) for key in flags), *(k for k in keep if k in observable))
        observed = {key if isinstance(key, str) else key[0] for key in self._observed}
        self._dropped = {env.reward_key, "info"} - observed

    def iterator(self) -> Iterator[TensorDictBase]:
        """Yields batches until `total_frames`; what a `for` over the collector goes through."""
        while self.total_frames < 0 or self.frames < self.total_frames:
            yield self.collect()

    @torch.no_grad()
    def collect(self, num_worlds: int | None = None) -> TensorDictBase:
        """Runs one episode in every world, or in the first `num_worlds`. Shape: (T_total,)."""
        state = self.env.reset()
        active = torch.ones(self.env.batch_size, dtype=torch.bool, device=state.device)
        active[len(active) if num_worlds is None else num_worlds :] = False
        flying = int(active.sum())
        worlds: list[Tensor] = []
        steps: list[dict[NestedKey, Tensor]] = []
        while len(indices := active.nonzero()[:, 0]):
            step, state = self._step(state, active, indices)
            worlds.append(indices)
            steps.append(step)
            active = active & ~state.get("done").reshape(active.shape)
        batch = _join(steps, worlds, len(active))
        batch["collector", "traj_ids"] += self.episodes
        self.frames += len(batch)
        self.episodes += flying
        return batch if self.postproc is None else self.postproc(batch)

    def _step(
        self, state: TensorDictBase, active: Tensor, worlds: Tensor
    ) -> tuple[dict[NestedKey, Tensor], TensorDictBase]:
        """Acts in the active worlds. Returns what is kept of them and the state after them."""
        is_whole = len(worlds) == len(active)
        seen = state.select(*self._observed)
        acted = self.actor(seen if is_whole else _rows(seen, worlds))
        action = acted.get(self.env.action_key)
        keys = acted.keys(True, True) if self._keep_observations else (self.env.action_key,)
        step = {key: acted.get(key) for key in keys}
        if not is_whole:
            action = self.env.action_spec.zero().index_copy(0, worlds, action)
            state.set("_step", active)
        state.set(self.env.action_key, action)
        after = self.env.step(state)
        for key in self._kept:
            value = after.get(key)
            step[key] = value if is_whole else value[worlds]
        state = after.get("next")
        for key in self._dropped:  # entries that no step reads make each step dearer
            state.pop(key, None)
        return step, state

    def state_dict(self) -> dict:
        """Counters and the environment's random streams, as they stand between two batches."""
        worlds = getattr(self.env, "base_env", self.env).state_dict()
        return {"frames": self.frames, "episodes": self.episodes, "worlds": worlds}

    def load_state_dict(self, state_dict: dict) -> None:
        """Goes on from a `state_dict`."""
        self.frames, self.episodes = state_dict["frames"], state_dict["episodes"]
        getattr(self.env, "base_env", self.env).load_state_dict(state_dict["worlds"])

    def set_seed(self, seed: int, static_seed: bool = False) -> int:
        """Seeds the worlds; the actor's draws are the business of whoever made its generator.

        Returns:
            A seed for the next collector, or the same if it is static.
        """
        return self.env.set_seed(seed, static_seed=static_seed)

    def shutdown(
        self, timeout: float | None = None, close_env: bool = True, raise_on_error: bool = True
    ) -> None:
        """Closes the environment, unless it shall stay open."""
        if close_env and not self.env.is_closed:
            self.env.close()

    def __len__(self) -> int:
        """How many batches there will be is not known: they differ in length."""
        raise TypeError(f"the number of batches of {type(self).__name__} is not known beforehand")

    def _maybe_fallback_update(
        self, policy_or_weights: Any = None, *, model_id: str | None = None
    ) -> None:
        """What `update_policy_weights_` does: nothing without weights, if the actor is shared."""
        if policy_or_weights is not None:
            copy_weights(policy_or_weights, self.actor)


def copy_weights(source: Any, actor: TensorDictModuleBase) -> None:
    """Copies parameters into an actor.

    Args:
        source: Another such actor, its `state_dict`, or a TensorDict of its parameters.
        actor: Gets them.
    """
    if isinstance(source, TensorDictBase):
        weights = cast(TensorDictBase, TensorDict.from_module(actor))
        weights.data.update_(source.data)
    else:
        actor.load_state_dict(source.state_dict() if isinstance(source, nn.Module) else source)


def _rows(tensordict: TensorDictBase, rows: Tensor) -> TensorDictBase:
    """What indexing gives, without tensordict's search for the shape of it, which takes longer."""
    taken = {key: tensordict.get(key).index_select(0, rows) for key in tensordict.keys(True, True)}
    return TensorDict(taken, [len(rows)], device=tensordict.device)


def _as_tuple(key: NestedKey) -> tuple[str, ...]:
    return (key,) if isinstance(key, str) else key


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
