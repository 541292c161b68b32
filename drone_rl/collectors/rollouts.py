# pyright: reportIncompatibleMethodOverride=false
# (TorchRL's collectors annotate states otherwise than they use them.)
"""Rollouts of fixed length, in worlds that go on from batch to batch: what critics learn from."""

from typing import Any

import torch
from tensordict import TensorDict, TensorDictBase
from tensordict.nn import TensorDictModuleBase
from tensordict.utils import NestedKey
from torch import Tensor
from torchrl.envs import EnvBase

from drone_rl.collectors.worlds_collector import WorldsCollector
from drone_rl.utils.errors import InputError


class RolloutCollector(WorldsCollector):
    """Iterates over batches of the next `num_steps` steps of every world. Shape: (num_envs, T).

    A world whose episode ends begins another at once. Its row goes on with it, while
    ("next", ...) holds what the actor would have seen of the old one: a critic can tell what a
    state is worth where a row is cut, be it by the time limit or by the end of the batch.
    ("next", "episode_reward") and ("next", "step_count"), which TorchRL's `RewardSum` and
    `StepCounter` write, count from the start of an episode, in whichever batch that was.

    Every batch is collected by one policy, so it is strictly on-policy.
    """

    def __init__(
        self, env: EnvBase, actor: TensorDictModuleBase, num_steps: int, **kwargs: Any
    ) -> None:
        """Connects an environment and a policy.

        Args:
            env: A batched environment.
            actor: Writes the action.
            num_steps: Of each world in a batch.
            kwargs: See `WorldsCollector`.

        Raises:
            InputError: The environment is not a batch of worlds, or there are no steps.
        """
        if num_steps < 1:
            raise InputError(f"num_steps={num_steps} is out of range; give 1 or more")
        super().__init__(env, actor, **kwargs)
        self.num_steps = num_steps
        self._state: TensorDictBase | None = None
        self._reward = torch.zeros(*env.batch_size, 1, device=env.device)
        self._steps = torch.zeros(*env.batch_size, 1, dtype=torch.int64, device=env.device)

    @torch.no_grad()
    def collect(self) -> TensorDictBase:
        """Goes on in every world. Shape: (num_envs, T)."""
        state, steps, episodes = self._begin(), dict[NestedKey, Tensor](), 0
        for t in range(self.num_steps):
            step, state = self._step(state)
            for key, value in step.items():
                if t == 0:
                    steps[key] = value.new_empty(len(value), self.num_steps, *value.shape[1:])
                steps[key][:, t] = value
            ended = step["next", "done"]
            if bool(ended.any()):
                state = self._start_again(state, ended)
                episodes += int(ended.sum())
        self._state = state
        batch = TensorDict({}, [*self.env.batch_size, self.num_steps], device=self.env.device)
        for key, value in steps.items():
            batch.set(key, value)
        return self._finish(batch, episodes)

    def _begin(self) -> TensorDictBase:
        """What the worlds show now; the first time, once all have started."""
        if self._state is None:
            self._state = self._without_ballast(self.env.reset())
        return self._state

    def _step(self, state: TensorDictBase) -> tuple[dict[NestedKey, Tensor], TensorDictBase]:
        """Acts. Returns what is kept, and the state after it."""
        acted = self.actor(state.select(*self._observed))
        step = {key: acted.get(key) for key in acted.keys(True, True)}
        state.set(self.env.action_key, acted.get(self.env.action_key))
        after = self.env.step(state)
        following = after.get("next")
        self._reward = self._reward + following.get(self.env.reward_key)
        self._steps = self._steps + 1
        step |= {key: after.get(key) for key in self._kept}
        step |= {("next", key): following.get(key) for key in self._observed}
        step |= {("next", "episode_reward"): self._reward, ("next", "step_count"): self._steps}
        return step, self._without_ballast(following)

    def _start_again(self, state: TensorDictBase, ended: Tensor) -> TensorDictBase:
        """New episodes where old ones ended.

        TorchRL's `reset` would copy all worlds' pictures, and more than once.
        """
        self._reward, self._steps = self._reward * ~ended, self._steps * ~ended
        fresh = self.env._reset(TensorDict({"_reset": ended}, state.batch_size))
        worlds = ended.flatten().nonzero()[:, 0]
        begun = TensorDict({}, state.batch_size, device=state.device)
        for key in state.keys(True, True):
            rows = fresh.get(key).index_select(0, worlds)
            begun.set(key, state.get(key).index_copy(0, worlds, rows))
        return begun

    def _without_ballast(self, state: TensorDictBase) -> TensorDictBase:
        """Without entries that no step reads, which make each step dearer."""
        return state.exclude(*self._dropped, *self.env.done_keys)

    def set_seed(self, seed: int, static_seed: bool = False) -> int:
        """See `WorldsCollector.set_seed`; all episodes begin anew."""
        self._state = None
        self._reward, self._steps = torch.zeros_like(self._reward), torch.zeros_like(self._steps)
        return super().set_seed(seed, static_seed=static_seed)

    def state_dict(self) -> dict:
        """All that is known of the episodes under way, but for the pictures."""
        carried = self._begin().exclude(*self._observed)
        return {
            "frames": self.frames,
            "episodes": self.episodes,
            "worlds": self.worlds.running_state(),
            "transforms": self._memories(),
            "carried": carried.to_dict(),
            "episode_reward": self._reward,
            "step_count": self._steps,
        }

    def load_state_dict(self, state_dict: dict) -> None:
        """Goes on within the episodes of a `state_dict`; pictures are drawn anew."""
        self._begin()  # without which transforms have no memory yet
        self.frames, self.episodes = state_dict["frames"], state_dict["episodes"]
        self.worlds.load_running_state(state_dict["worlds"])
        if self.env is not self.worlds:
            self.env.load_state_dict(state_dict["transforms"])
        nobody = torch.zeros_like(self._steps, dtype=torch.bool)
        drawn = self.env._reset(TensorDict({"_reset": nobody}, self.env.batch_size))
        self._state = self._without_ballast(drawn).update(state_dict["carried"])
        self._reward = state_dict["episode_reward"].to(self._reward, copy=True)
        self._steps = state_dict["step_count"].to(self._steps, copy=True)

    def _memories(self) -> dict:
        """What transforms remember of earlier frames."""
        return {} if self.env is self.worlds else dict(self.env.state_dict())
