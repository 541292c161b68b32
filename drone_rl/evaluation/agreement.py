"""Does another program do what a policy does? Asked about every picture of the policy's flights."""

import dataclasses
from collections.abc import Callable
from typing import Any

import torch
from tensordict.nn import TensorDictModuleBase
from torch import Tensor
from torchrl.envs import TransformedEnv
from torchrl.envs.utils import ExplorationType, set_exploration_type

from drone_rl.envs import worlds_of


@dataclasses.dataclass(frozen=True)
class Agreement:
    """How far two programs agree on the probabilities of actions, or of their parts."""

    frames: int
    """Pictures that both were asked about."""
    difference: float
    """The greatest in any probability; NaN if any is no number."""
    actions_differ: int
    """Pictures of which they call different actions, or parts, the most probable."""


@torch.no_grad()
def agreement(
    env: TransformedEnv,
    actor: TensorDictModuleBase,
    other: Callable[[Tensor], Tensor],
    steps: int,
) -> Agreement:
    """Flies a policy, with drawn actions, and compares another program with it at every step.

    Args:
        env: Worlds of `DroneEnv` behind transforms.
        actor: The policy; it writes "logits".
        other: Takes RGB pictures (N, H, W, 3), uint8, and gives probabilities (N, A), see
            `Actions.wish`; on the CPU.
        steps: Of each world; those whose episode ends begin another.
    """
    base: Any = env.base_env
    actions = worlds_of(env).dynamics.actions
    wishes, others, state = [], [], env.reset()
    with set_exploration_type(ExplorationType.RANDOM):
        for _ in range(steps):
            state = actor(state)
            wishes.append(actions.wish(state["logits"]).cpu())
            others.append(other(base.last_pixels.cpu()))
            state = env.step_and_maybe_reset(state)[1]
    mine, its = torch.cat(wishes), torch.cat(others)
    return Agreement(
        frames=len(mine),
        difference=float((mine - its).abs().max()),
        actions_differ=int((actions.chosen(mine) != actions.chosen(its)).sum()),
    )
