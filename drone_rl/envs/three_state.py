"""The three-state Markov decision process of Fig. 3, whose exact gradient is known."""

from collections.abc import Sequence

import torch
from tensordict import TensorDict, TensorDictBase
from torchrl.data import Binary, Categorical, Composite, OneHot, Unbounded
from torchrl.envs import EnvBase

SUCCESS_PROBABILITY = 0.75
"""Probability that action 1 in state 0 leads to state 2 and reward 1, else to state 1 and 0."""


def exact_gradient(leaving: Sequence[float], gamma: float = 1.0) -> torch.Tensor:
    """Return the exact policy gradient with respect to the logit of action 1 at each step.

    It is P(still in state 0) p (1 - p) (Q(action 1) - Q(action 0)), with p of the step. With gamma
    = 1 it is the gradient of the expected reward. With gamma < 1 it is the expectation of Eq. 15
    with returns discounted from their own step: REINFORCE follows it, although it is not the
    gradient of any objective.

    Args:
        leaving: The policy's probability of action 1 in state 0 at each step.
        gamma: Discount rate of Q.

    Returns:
        Shape: (len(leaving),), float64.
    """
    value, lead = 0.0, []
    for leave in reversed(leaving):
        stay = gamma * value
        lead.insert(0, SUCCESS_PROBABILITY - stay)
        value = leave * SUCCESS_PROBABILITY + (1 - leave) * stay
    p = torch.tensor(leaving, dtype=torch.float64)
    still_there = torch.cat([p.new_ones(1), (1 - p).cumprod(0)[:-1]])
    return still_there * p * (1 - p) * p.new_tensor(lead)


class ThreeStateEnv(EnvBase):
    """Action 0 stays in state 0; action 1 goes to state 1 (25%) or, for reward 1, to state 2.

    States 1 and 2 terminate the episode. In state 0 the episode is truncated after `horizon` steps.
    The observation is the one-hot state, shape (num_envs, 3).
    """

    def __init__(self, num_envs: int, *, horizon: int = 3, seed: int = 0) -> None:
        """Create the environments.

        Args:
            num_envs: Number of environments.
            horizon: Number of steps after which an episode is truncated.
            seed: Seed of the transitions.
        """
        super().__init__(batch_size=torch.Size([num_envs]))
        self.horizon = horizon
        n = num_envs
        self.observation_spec = Composite(
            observation=OneHot(3, shape=torch.Size([n, 3]), dtype=torch.float32), shape=(n,)
        )
        self.action_spec = Categorical(2, shape=self.batch_size, dtype=torch.int64)
        self.reward_spec = Unbounded(torch.Size([n, 1]))
        flags = ("done", "terminated", "truncated")
        self.full_done_spec = Composite(
            {name: Binary(1, torch.Size([n, 1]), dtype=torch.bool) for name in flags}, shape=(n,)
        )
        self._state = torch.zeros(n, dtype=torch.int64)
        self._steps = torch.zeros(n, dtype=torch.int64)
        self.set_seed(seed)

    def _set_seed(self, seed: int | None) -> None:
        self._generator = torch.Generator().manual_seed(0 if seed is None else seed)

    def _reset(self, tensordict: TensorDictBase | None = None, **kwargs: object) -> TensorDictBase:
        mask = None if tensordict is None else tensordict.get("_reset", None)
        fresh = torch.ones(self.batch_size, dtype=torch.bool) if mask is None else mask.view(-1)
        self._state = self._state.masked_fill(fresh, 0)
        self._steps = self._steps.masked_fill(fresh, 0)
        return self._observe(torch.zeros(self.batch_size, dtype=torch.bool), None)

    def _step(self, tensordict: TensorDictBase) -> TensorDictBase:
        leaves = (tensordict["action"] == 1) & (self._state == 0)
        draw = torch.rand(self.batch_size, generator=self._generator)
        goal = torch.where(draw < SUCCESS_PROBABILITY, 2, 1)
        self._state = torch.where(leaves, goal, self._state)
        self._steps = self._steps + 1
        reward = (leaves & (self._state == 2)).float()
        return self._observe(self._state > 0, reward)

    def _observe(self, terminated: torch.Tensor, reward: torch.Tensor | None) -> TensorDict:
        truncated = ~terminated & (self._steps >= self.horizon)
        entries = {
            "observation": torch.nn.functional.one_hot(self._state, 3).float(),
            "terminated": terminated[:, None],
            "truncated": truncated[:, None],
            "done": (terminated | truncated)[:, None],
        }
        if reward is not None:
            entries["reward"] = reward[:, None]
        return TensorDict(entries, self.batch_size)
