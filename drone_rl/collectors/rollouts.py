"""Collects rollouts of fixed length; episodes continue from batch to batch."""

import itertools
from collections.abc import Iterator
from typing import Any, Unpack

import torch
from tensordict import TensorDict, TensorDictBase
from tensordict.nn import TensorDictModuleBase
from torch import Tensor
from torchrl.envs import EnvBase

from drone_rl.acceleration import FusedRollouts, Reasons
from drone_rl.acceleration.fused_episodes import END_REASON, REWARD
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

    def __init__(
        self,
        env: EnvBase,
        actor: TensorDictModuleBase,
        num_steps: int,
        *,
        compiled: bool = False,
        num_threads: int = 1,
        **options: Unpack[BatchOptions],
    ) -> None:
        """Connect an environment and a policy; arguments as of `EpisodeCollector`."""
        if num_steps < 1:
            raise InputError(f"num_steps={num_steps} is out of range; give 1 or more")
        super().__init__(env, actor, **options)
        self.num_steps = num_steps
        self._steps: Iterator[Step] | None = None
        if self._info:
            self.fused = Reasons(["info is not fused"])
        elif compiled:
            self.fused = FusedRollouts.try_create(
                self.base_env, actor, True, num_threads, num_steps
            )
        self._is_running = False
        self._reward = torch.zeros(*env.batch_size, 1, device=env.device)
        self._count = torch.zeros(*env.batch_size, 1, dtype=torch.int64, device=env.device)

    @torch.no_grad()
    def collect(self) -> TensorDictBase:
        """Step every environment `num_steps` times. Shape: (num_envs, T)."""
        if isinstance(self.fused, Reasons) or not self.fused.can_act:
            return self._step()
        return self._advance(self.fused)

    def _advance(self, fused: FusedRollouts) -> TensorDictBase:
        """Collect a batch by the kernel."""
        env, shape = self.base_env, (*self.env.batch_size, self.num_steps)
        starts = self._start()
        entries, env.worlds.state = fused.advance(env.worlds.state, starts)
        outcome = env.outcome(entries[END_REASON].flatten(), entries[REWARD].flatten())
        entries |= {key: value.unflatten(0, shape) for key, value in outcome.items()}
        rewards, counts, ended = [], [], entries["next", "done"]
        for t in range(self.num_steps):
            self._reward, self._count = self._reward + entries[REWARD][:, t], self._count + 1
            rewards.append(self._reward)
            counts.append(self._count)
            going = ~ended[:, t]
            self._reward, self._count = self._reward * going, self._count * going
        entries["next", "episode_reward"] = torch.stack(rewards, 1)
        entries["next", "step_count"] = torch.stack(counts, 1)
        return self._finish(TensorDict(entries, shape, device=env.device), int(ended.sum()))

    def _start(self) -> Tensor:
        """Start all episodes unless they are running; return the indices of those that start."""
        if self._is_running:
            return torch.arange(0)
        self._forget()
        self._is_running = True
        self.base_env.start()
        return torch.arange(self.env.batch_size[0])

    def _forget(self) -> None:
        """Let new episodes begin."""
        self._steps, self._is_running = None, False
        self._reward, self._count = map(torch.zeros_like, (self._reward, self._count))

    def _step(self) -> TensorDictBase:
        """Collect a batch step by step; after batches of the kernel, from new episodes."""
        env, batch, episodes = self.base_env, Entries(), 0
        if self._is_running:
            self._forget()
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
        self._forget()
        return super().set_seed(seed, static_seed=static_seed)

    def state_dict(self) -> dict[str, Any]:  # pyright: ignore[reportIncompatibleMethodOverride]
        """Return the state of the episodes under way, without observations."""
        recent = torch.empty(0)
        if isinstance(self.fused, Reasons):
            self._running()
        else:
            self._start()
            self.base_env.observe(torch.arange(len(self._reward)), True)  # the observer's memory
            recent = self.fused.last_observations
        return {
            "recent": recent,
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
        self._steps, self._is_running = None, not isinstance(self.fused, Reasons)
        if isinstance(self.fused, Reasons):
            self._running(self.base_env.worlds.state)
        else:
            self.fused.last_observations.copy_(state_dict["recent"])
        self._reward = state_dict["episode_reward"].to(self._reward, copy=True)
        self._count = state_dict["step_count"].to(self._count, copy=True)
