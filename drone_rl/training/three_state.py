"""REINFORCE on the chapter's three-state process (Fig. 3), next to the exact policy gradient."""

import dataclasses
from typing import Any

import torch
from tensordict.nn import TensorDictModule
from torch import Tensor, nn
from torchrl.data import Categorical
from torchrl.envs.utils import step_mdp
from torchrl.modules import ProbabilisticActor

from drone_rl.envs.three_state import ThreeStateEnv
from drone_rl.objectives import ReinforceLoss, TotalReward
from drone_rl.policies.actor import RandomSource, SeededCategorical


@dataclasses.dataclass(frozen=True)
class ThreeStateTraining:
    """Course of a training on the three-state process."""

    leaving: Tensor
    """Probability of action 1 in state 0 before each update and after the last. (updates + 1,)."""
    rewards: Tensor
    """Mean reward of the episodes of each update. Shape: (updates,)."""


def train_three_state(
    updates: int = 100,
    *,
    episodes: int = 8,
    lr: float = 1.0,
    horizon: int = 3,
    seed: int = 0,
) -> ThreeStateTraining:
    """Train a table of logits by REINFORCE, as in Eqs. 12 and 13.

    Args:
        updates: Steps of gradient ascent.
        episodes: Episodes of each update, N in Eq. 12.
        lr: Learning rate, alpha in Eq. 13.
        horizon: Steps after which an episode in state 0 is truncated.
        seed: Seed of transitions and actions.
    """
    learner = _Learner(episodes, horizon, seed)
    optimizer = torch.optim.SGD(learner.table.parameters(), lr=lr)
    leaving, rewards = [learner.leaving], []
    for _ in range(updates):
        rewards.append(learner.accumulate_gradient() / episodes)
        optimizer.step()
        leaving.append(learner.leaving)
    return ThreeStateTraining(torch.tensor(leaving), torch.tensor(rewards))


def sample_gradients(count: int, *, episodes: int = 8, horizon: int = 3, seed: int = 0) -> Tensor:
    """Return estimates (Eq. 12) of the uniform policy's gradient by action 1's logit. (count,).

    Their expectation is the sum of `drone_rl.envs.three_state.exact_gradient` over the steps.
    """
    learner = _Learner(episodes, horizon, seed)
    gradients = []
    for _ in range(count):
        learner.accumulate_gradient()
        (weight,) = learner.table.parameters()
        assert weight.grad is not None
        gradients.append(-weight.grad[1, 0].clone())
    return torch.stack(gradients)


class _Learner:
    """A table of logits, initially of equal actions, with a collector and the loss."""

    def __init__(self, episodes: int, horizon: int, seed: int) -> None:
        self.table = nn.Linear(3, 2, bias=False)
        nn.init.zeros_(self.table.weight)
        source = RandomSource(torch.Generator().manual_seed(seed))
        actor = ProbabilisticActor(
            TensorDictModule(self.table, in_keys=["observation"], out_keys=["logits"]),
            in_keys=["logits"],
            spec=Categorical(2),
            distribution_class=SeededCategorical,
            distribution_kwargs={"source": source},
            default_interaction_type="random",
        )
        self._env, self._actor = ThreeStateEnv(episodes, horizon=horizon, seed=seed), actor
        self._returns = TotalReward()
        self._loss = ReinforceLoss(actor, reduction="episode_mean", entropy_coeff=0.0)

    @property
    def leaving(self) -> float:
        """Probability of action 1 in state 0."""
        return float(self.table.weight.detach()[:, 0].softmax(0)[1])

    def accumulate_gradient(self) -> float:
        """Run a batch of episodes, set the gradient of the loss and return the sum of rewards."""
        state, steps, masks = self._env.reset(), [], []
        running = torch.ones(len(state), dtype=torch.bool)
        while bool(running.any()):
            action = torch.zeros(len(state), dtype=torch.int64)
            with torch.no_grad():
                action[running] = self._actor(state[running])["action"]
            after = self._env.step(state.set("action", action))
            steps.append(after)
            masks.append(running)
            running = running & ~after["next", "done"][:, 0]
            state = step_mdp(after)
        rolled: Any = torch.stack(steps, 1)
        batch = self._returns(rolled[torch.stack(masks, 1)])
        self.table.zero_grad()
        self._loss(batch)["loss_actor"].backward()
        return float(batch["next", "reward"].sum())
