"""Collects rollouts of fixed length; episodes continue from batch to batch."""

import itertools
from collections.abc import Iterator
from typing import Any, Unpack

import torch
from tensordict import TensorDict, TensorDictBase
from tensordict.nn import TensorDictModuleBase
from torchrl.envs import EnvBase

from drone_rl.collectors.collector import BatchedCollector, BatchOptions
from drone_rl.envs.drone_env import Entries
from drone_rl.envs.rollout import Step, steps
from drone_rl.utils.errors import InputError


class RolloutCollector(BatchedCollector):
    """Iterate over batches of the next `num_steps` steps of every environment: (num_envs, T).

    An environment resets when its episode ends, and its row continues with the next episode.
    ("next", ...) holds the last observation of the old one, from which a critic can bootstrap.
    ("next", "episode_reward") and ("next", "step_count") count from the start of an episode, even
    in an earlier batch, as TorchRL's `RewardSum` and `StepCounter` do.
    """

    name = "stepping collector"
    """Name in the log."""

    def __init__(
        self,
        env: EnvBase,
        actor: TensorDictModuleBase,
        num_steps: int,
        **options: Unpack[BatchOptions],
    ) -> None:
        """Connect an environment and a policy; `options` and errors as in `BatchedCollector`."""
        if num_steps < 1:
            raise InputError(f"num_steps={num_steps} is out of range; give 1 or more")
        super().__init__(env, actor, **options)
        self.num_steps = num_steps
        self._steps: Iterator[Step] | None = None
        self._reward = torch.zeros(*env.batch_size, 1, device=env.device)
        self._count = torch.zeros(*env.batch_size, 1, dtype=torch.int64, device=env.device)

    @torch.no_grad()
    def collect(self) -> TensorDictBase:
        """Step every environment `num_steps` times. Shape: (num_envs, T)."""
        env, batch, episodes = self.base_env, Entries(), 0
        for t, step in enumerate(itertools.islice(self._running(), self.num_steps)):
            entries = self._entries(step)
            for key, value in entries.items():
                if t == 0:
                    batch[key] = value.new_empty(len(value), self.num_steps, *value.shape[1:])
                batch[key][:, t] = value
            ended = entries["next", "done"]
            self._reward, self._count = self._reward * ~ended, self._count * ~ended
            episodes += int(ended.sum())
            env.worlds.state = step.next_state
        result = TensorDict({}, [*self.env.batch_size, self.num_steps], device=self.env.device)
        for key, value in batch.items():
            result.set(key, value)
        return self._finish(result, episodes)

    def _running(self, state: Any = None) -> Iterator[Step]:
        """Return all further steps, from new episodes at first, or episodes under way."""
        if self._steps is None:
            env = self.base_env
            self._steps = steps(
                self._agent,
                env.observer,
                env.start() if state is None else state,
                starts=True if state is None else None,
                restart=env.start,
                looks_ahead=True,
            )
        return self._steps

    def _entries(self, step: Step) -> Entries:
        """Return the kept entries of a step."""
        self._reward = self._reward + step.reward.float()[:, None]
        self._count = self._count + 1
        return {
            **step.act.entries,
            "action": step.act.action,
            **self.base_env.outcome(step.after.end_reason, step.reward),
            **self._kept_info(step),
            **{("next", name): value for name, value in step.following.inputs.items()},
            ("next", "episode_reward"): self._reward,
            ("next", "step_count"): self._count,
        }

    def set_seed(self, seed: int, static_seed: bool = False) -> int:
        """See `BatchedCollector.set_seed`; all episodes restart."""
        self._steps = None
        self._reward, self._count = torch.zeros_like(self._reward), torch.zeros_like(self._count)
        return super().set_seed(seed, static_seed=static_seed)

    def state_dict(self) -> dict[str, Any]:  # pyright: ignore[reportIncompatibleMethodOverride]
        """Return the state of the episodes under way, without observations."""
        self._running()
        return {
            "frames": self.frames,
            "episodes": self.episodes,
            "worlds": self.base_env.running_state(),
            "episode_reward": self._reward,
            "step_count": self._count,
        }

    def load_state_dict(self, state_dict: dict[str, Any]) -> None:
        """Resume within the episodes of a `state_dict`; observations are rendered again."""
        self.frames, self.episodes = state_dict["frames"], state_dict["episodes"]
        self.base_env.load_running_state(state_dict["worlds"])
        self._steps = None
        self._running(self.base_env.worlds.state)
        self._reward = state_dict["episode_reward"].to(self._reward, copy=True)
        self._count = state_dict["step_count"].to(self._count, copy=True)
