"""Collects rollouts of fixed length; episodes continue from batch to batch."""

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any, Unpack

import torch
from tensordict import TensorDict, TensorDictBase
from tensordict.nn import TensorDictModuleBase
from tensordict.utils import NestedKey
from torch import Tensor
from torchrl.envs import EnvBase

from drone_rl.collectors.batched_collector import BatchedCollector, BatchOptions
from drone_rl.collectors.speedups import accelerated_stepper
from drone_rl.envs import base_env
from drone_rl.envs.direct_renderer import Entries, Reasons
from drone_rl.utils.errors import InputError

if TYPE_CHECKING:
    from drone_rl.acceleration import DirectStepper


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
        **options: Unpack[BatchOptions],
    ) -> None:
        """Connect an environment and a policy; `options` and errors as in `BatchedCollector`."""
        if num_steps < 1:
            raise InputError(f"num_steps={num_steps} is out of range; give 1 or more")
        super().__init__(env, actor, **options)
        self.num_steps = num_steps
        stepper = accelerated_stepper(env, self._observed, self._kept)
        self._stepper: DirectStepper | TorchrlStepper = (
            TorchrlStepper(env, self._observed, self._kept, stepper)
            if isinstance(stepper, Reasons)
            else stepper
        )
        self._reward = torch.zeros(*env.batch_size, 1, device=env.device)
        self._steps = torch.zeros(*env.batch_size, 1, dtype=torch.int64, device=env.device)

    @property
    def name(self) -> str:
        """Name of the stepper in the log."""
        return self._stepper.name

    @torch.no_grad()
    def collect(self) -> TensorDictBase:
        """Step every environment `num_steps` times. Shape: (num_envs, T)."""
        steps, episodes = Entries(), 0
        for t in range(self.num_steps):
            step = self._step()
            for key, value in step.items():
                if t == 0:
                    steps[key] = value.new_empty(len(value), self.num_steps, *value.shape[1:])
                steps[key][:, t] = value
            ended = step["next", "done"]
            if bool(ended.any()):
                self._reward, self._steps = self._reward * ~ended, self._steps * ~ended
                self._stepper.restart(ended)
                episodes += int(ended.sum())
        batch = TensorDict({}, [*self.env.batch_size, self.num_steps], device=self.env.device)
        for key, value in steps.items():
            batch.set(key, value)
        return self._finish(batch, episodes)

    def _step(self) -> Entries:
        """Take one step; return the kept entries."""
        acted = self.actor(self._stepper.observe())
        step: Entries = {key: acted.get(key) for key in acted.keys(True, True)}
        step |= self._stepper.step(acted.get(self.env.action_key))
        self._reward = self._reward + step["next", self.env.reward_key]
        self._steps = self._steps + 1
        sums = {"episode_reward": self._reward, "step_count": self._steps}
        return step | {("next", name): value for name, value in sums.items()}

    def set_seed(self, seed: int, static_seed: bool = False) -> int:
        """See `BatchedCollector.set_seed`; all episodes restart."""
        self._stepper.forget()
        self._reward, self._steps = torch.zeros_like(self._reward), torch.zeros_like(self._steps)
        return super().set_seed(seed, static_seed=static_seed)

    def state_dict(self) -> dict[str, Any]:  # pyright: ignore[reportIncompatibleMethodOverride]
        """Return the state of the episodes under way, without observations."""
        return {
            "frames": self.frames,
            "episodes": self.episodes,
            **self._stepper.state_dict(),
            "episode_reward": self._reward,
            "step_count": self._steps,
        }

    def load_state_dict(self, state_dict: dict[str, Any]) -> None:
        """Resume within the episodes of a `state_dict`; observations are rendered again."""
        self.frames, self.episodes = state_dict["frames"], state_dict["episodes"]
        self._stepper.load_state_dict(state_dict)
        self._reward = state_dict["episode_reward"].to(self._reward, copy=True)
        self._steps = state_dict["step_count"].to(self._steps, copy=True)


class TorchrlStepper:
    """Step all environments by `env.step`; the caller calls `restart` when episodes end."""

    def __init__(
        self,
        env: EnvBase,
        observed: Iterable[NestedKey],
        next_keys: Iterable[NestedKey],
        reasons: Reasons,
    ) -> None:
        """See `accelerated_stepper`; the reasons are why there is no faster stepper."""
        self.name = f"stepping collector: {reasons}"
        """Name in the log."""
        self._env, self._observed, self._kept = env, tuple(observed), tuple(next_keys)
        read = {key if isinstance(key, str) else key[0] for key in self._observed}
        # copying entries that no step reads makes each step of TorchRL slower
        self._dropped = {*env.done_keys, *({env.reward_key, "info"} - read)}
        self._state: TensorDictBase | None = None

    def observe(self) -> TensorDictBase:
        """Return the observations; the first call starts all environments. Shape: (num_envs,)."""
        return self._begin().select(*self._observed)

    def _begin(self) -> TensorDictBase:
        if self._state is None:
            self._state = self._env.reset().exclude(*self._dropped)
        return self._state

    def step(self, action: Tensor) -> Entries:
        """Step every environment, actions (num_envs, *); return kept entries and observations."""
        after = self._env.step(self._begin().set(self._env.action_key, action))
        following = after.get("next")
        entries: Entries = {key: after.get(key) for key in self._kept}
        entries |= {("next", key): following.get(key) for key in self._observed}
        self._state = following.exclude(*self._dropped)
        return entries

    def restart(self, ended: Tensor) -> None:
        """Start new episodes where old ones ended. Shape: (num_envs, 1), bool.

        TorchRL's `reset` would copy the observations of all environments, several times.
        """
        state = self._begin()
        fresh = self._env._reset(TensorDict({"_reset": ended}, state.batch_size))
        indices = ended.flatten().nonzero()[:, 0]
        restarted = TensorDict({}, state.batch_size, device=state.device)
        for key in state.keys(True, True):
            rows = fresh.get(key).index_select(0, indices)
            restarted.set(key, state.get(key).index_copy(0, indices, rows))
        self._state = restarted

    def forget(self) -> None:
        """Start all episodes again at the next call of `observe`."""
        self._state = None

    def state_dict(self) -> dict[str, Any]:
        """Return the state of the episodes under way, without observations."""
        carried = self._begin().exclude(*self._observed)
        is_transformed = self._env is not base_env(self._env)
        return {
            "worlds": base_env(self._env).running_state(),
            "transforms": dict(self._env.state_dict()) if is_transformed else {},
            "carried": carried.to_dict(),
        }

    def load_state_dict(self, state: Mapping[str, Any]) -> None:
        """Resume within the episodes of a `state_dict`; observations are rendered again."""
        self._begin()  # transforms allocate their memory at a reset
        base_env(self._env).load_running_state(state["worlds"])
        if self._env is not base_env(self._env):
            self._env.load_state_dict(state["transforms"])
        nowhere = torch.zeros(*self._env.batch_size, 1, dtype=torch.bool, device=self._env.device)
        rendered = self._env._reset(TensorDict({"_reset": nowhere}, self._env.batch_size))
        self._state = rendered.exclude(*self._dropped).update(state["carried"])
