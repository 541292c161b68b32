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
from drone_rl.evaluation.evaluator import StepLog, run_episodes
from drone_rl.evaluation.fragility import compare
from drone_rl.policies.base_policy import Pilot
from drone_rl.policies.external_policy import ForeignPolicy

_CHECKED_EPISODES = 32
"""Episodes that check that a policy acts by the current frame only."""


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


def require_function(
    policy: Pilot, *, seed: int, device: str = "cpu", renderer: str = "raytrace"
) -> None:
    """Check that a policy from elsewhere acts by the frame alone; others do by their layers.

    Args:
        policy: Any.
        seed: Root of the random streams of the environments in which it is tried.
        device: Where it is flown.
        renderer: Who renders.

    Raises:
        InputError: It acts by the batch, by a frame's place in it, or by earlier calls.
    """
    if not isinstance(policy, ForeignPolicy):
        return
    with policy.flying(_CHECKED_EPISODES, seed=seed, device=device, renderer=renderer) as (
        env,
        actor,
    ):
        state, log = env.base_env.state_dict(), StepLog()
        flown = run_episodes(env, actor, _CHECKED_EPISODES, log=log)
        env.base_env.load_state_dict(state)
        compare(env, actor, flown=flown, log=log)
