"""Complete episodes, each frame once: what REINFORCE learns from."""

from collections.abc import Iterator

import torch
from tensordict import TensorDict, TensorDictBase
from tensordict.nn import TensorDictModuleBase
from torch import Tensor
from torchrl.envs import EnvBase

from drone_rl.utils.errors import InputError


class EpisodeCollector:
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
        keep: tuple = (("next", "info", "cubes"), ("next", "info", "end_reason")),
    ) -> None:
        """Connects an environment and a policy.

        Args:
            env: A batched environment that honours TorchRL's "_step" masks.
            actor: Writes the action.
            total_frames: Stop before a batch once this many frames were collected; -1 for never.
            keep_observations: Whether to keep what the actor saw and made of it.
            keep: Entries kept besides that, the action, the reward and the end flags.

        Raises:
            InputError: The environment is not a batch of worlds.
        """
        if len(env.batch_size) != 1:
            raise InputError(f"env has batch size {list(env.batch_size)}; give a batch of worlds")
        self.env = env
        self.actor = actor
        self.total_frames = total_frames
        self.frames = 0
        self.episodes = 0
        self._observed = tuple(actor.in_keys)
        self._keep_observations = keep_observations
        flags = (env.reward_key, *env.done_keys)
        self._kept = (*(("next", key) for key in flags), *keep)

    def __iter__(self) -> Iterator[TensorDictBase]:
        """Yields batches until `total_frames`."""
        while self.total_frames < 0 or self.frames < self.total_frames:
            yield self.collect()

    @torch.no_grad()
    def collect(self) -> TensorDictBase:
        """Runs one episode in every world. Shape of the batch: (T_total,)."""
        state = self.env.reset()
        active = torch.ones(self.env.batch_size, dtype=torch.bool, device=state.device)
        steps: list[TensorDictBase] = []
        while active.any():
            record, state = self._step(state, active)
            steps.append(record)
            active = active & ~state["done"].reshape(active.shape)
        batch = _join(steps, len(active))
        batch["collector", "traj_ids"] += self.episodes
        self.frames += len(batch)
        self.episodes += len(active)
        return batch

    def _step(self, state: TensorDictBase, active: Tensor) -> tuple[TensorDictBase, TensorDictBase]:
        """Acts in the active worlds. Returns their transitions and the state after them."""
        worlds = active.nonzero()[:, 0]
        everyone = len(worlds) == len(active)
        seen = state.select(*self._observed)
        acted = self.actor(seen if everyone else seen[worlds])
        action = acted[self.env.action_key]
        if not everyone:
            action = self.env.action_spec.zero().index_copy(0, worlds, action)
            state["_step"] = active
        state[self.env.action_key] = action
        after = self.env.step(state)
        record = after.select(*self._kept)
        kept = acted if self._keep_observations else acted.select(self.env.action_key)
        record = kept.update(record if everyone else record[worlds])
        record["collector"] = TensorDict({"traj_ids": worlds}, record.batch_size)
        return record, after["next"].exclude(self.env.reward_key)

    def state_dict(self) -> dict:
        """Counters and the environment's random streams, as they stand between two batches."""
        worlds = getattr(self.env, "base_env", self.env).state_dict()
        return {"frames": self.frames, "episodes": self.episodes, "worlds": worlds}

    def load_state_dict(self, state: dict) -> None:
        """Goes on from a `state_dict`."""
        self.frames, self.episodes = state["frames"], state["episodes"]
        getattr(self.env, "base_env", self.env).load_state_dict(state["worlds"])

    def shutdown(self) -> None:
        """Closes the environment."""
        if not self.env.is_closed:
            self.env.close()


def _join(steps: list[TensorDictBase], num_worlds: int) -> TensorDictBase:
    """Time-major steps to episode after episode, copying each frame once. Shape: (T_total,)."""
    worlds = [step["collector", "traj_ids"] for step in steps]
    lengths = torch.cat(worlds).bincount(minlength=num_worlds)
    first = lengths.cumsum(0) - lengths
    rows = [first[indices] + t for t, indices in enumerate(worlds)]
    batch = TensorDict({}, [int(lengths.sum())], device=steps[0].device)
    for key in steps[0].keys(include_nested=True, leaves_only=True):
        parts = [step.get(key) for step in steps]
        joined = parts[0].new_empty(len(batch), *parts[0].shape[1:])
        for indices, part in zip(rows, parts, strict=True):
            joined.index_copy_(0, indices, part)
        batch.set(key, joined)
    return batch
