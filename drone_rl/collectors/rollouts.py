# pyright: reportIncompatibleMethodOverride=false
# (TorchRL's collectors annotate states otherwise than they use them.)
"""Rollouts of fixed length, in worlds that go on from batch to batch: what critics learn from."""

from typing import Any

import torch
from tensordict import TensorDict, TensorDictBase
from tensordict.nn import TensorDictModuleBase
from torchrl.envs import EnvBase

from drone_rl.collectors.streams import find_stream
from drone_rl.collectors.worlds_collector import WorldsCollector
from drone_rl.envs.direct_renderer import Entries
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
        self._way = find_stream(env, self._observed, self._kept)
        self._reward = torch.zeros(*env.batch_size, 1, device=env.device)
        self._steps = torch.zeros(*env.batch_size, 1, dtype=torch.int64, device=env.device)

    @torch.no_grad()
    def collect(self) -> TensorDictBase:
        """Goes on in every world. Shape: (num_envs, T)."""
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
                self._way.restart(ended)
                episodes += int(ended.sum())
        batch = TensorDict({}, [*self.env.batch_size, self.num_steps], device=self.env.device)
        for key, value in steps.items():
            batch.set(key, value)
        return self._finish(batch, episodes)

    def _step(self) -> Entries:
        """Acts. Returns what is kept."""
        acted = self.actor(self._way.seen())
        step: Entries = {key: acted.get(key) for key in acted.keys(True, True)}
        step |= self._way.step(acted.get(self.env.action_key))
        self._reward = self._reward + step["next", self.env.reward_key]
        self._steps = self._steps + 1
        told = {"episode_reward": self._reward, "step_count": self._steps}
        return step | {("next", name): value for name, value in told.items()}

    def set_seed(self, seed: int, static_seed: bool = False) -> int:
        """See `WorldsCollector.set_seed`; all episodes begin anew."""
        self._way.forget()
        self._reward, self._steps = torch.zeros_like(self._reward), torch.zeros_like(self._steps)
        return super().set_seed(seed, static_seed=static_seed)

    def state_dict(self) -> dict:
        """All that is known of the episodes under way, but for the pictures."""
        return {
            "frames": self.frames,
            "episodes": self.episodes,
            **self._way.state_dict(),
            "episode_reward": self._reward,
            "step_count": self._steps,
        }

    def load_state_dict(self, state_dict: dict) -> None:
        """Goes on within the episodes of a `state_dict`; pictures are drawn anew."""
        self.frames, self.episodes = state_dict["frames"], state_dict["episodes"]
        self._way.load_state_dict(state_dict)
        self._reward = state_dict["episode_reward"].to(self._reward, copy=True)
        self._steps = state_dict["step_count"].to(self._steps, copy=True)
