"""The self-check of third-party policies, on the first frames of episodes."""

from collections.abc import Callable, Iterable
from typing import Any

import torch
from tensordict.nn import TensorDictModuleBase
from torch import Tensor

from drone_rl.envs import base_env
from drone_rl.envs.rollout import ActorAgent, steps
from drone_rl.policies.policy import BasePolicy
from drone_rl.policies.rounding import TOLERANCE, require_same_in_any_batch
from drone_rl.utils.errors import InputError

_ENVIRONMENTS, _RESETS, _STEPS = 2, 2, 6
_PROBABILITY = 1e-3
"""Difference of probabilities that counts as another policy."""
Predict = Callable[[Tensor], tuple[Tensor, Tensor]]
"""From the frames of an episode, RGB bytes (T, H, W, 3), to actions (T,) and logits (T, A)."""


@torch.no_grad()
def check_on_episodes(
    policy: BasePolicy, predict: Predict | None = None, wrappers: Iterable[str] = ()
) -> None:
    """Compare a policy's network with itself in other batches, and with its own library.

    Args:
        policy: The policy.
        predict: What the library does with the frames of an episode, with its wrappers.
        wrappers: Names of these wrappers, for the message.

    Raises:
        InputError: They differ, or the network fails.
    """
    with policy.flying(_ENVIRONMENTS) as (env, actor):
        episodes = [pair for _ in range(_RESETS) for pair in _fly(env, actor)]
    network = policy.make_network()
    network.owner = f"policy={policy.name}"
    pixels = torch.cat([seen for _, seen in episodes])
    require_same_in_any_batch(network, pixels, [len(pixels)])
    if predict is None:
        return
    theirs = [predict(frames) for frames, _ in episodes]
    actions, logits = (torch.cat(parts) for parts in zip(*theirs, strict=True))
    network_logits = network(pixels)
    is_other = (network_logits.softmax(-1) - logits.softmax(-1)).abs().amax(-1) > _PROBABILITY
    lead = network_logits.amax(-1) - network_logits.gather(1, actions[:, None])[:, 0]
    is_other |= lead > TOLERANCE * (1 + network_logits.abs().amax(-1))
    if is_other.any():
        names = ", ".join(wrappers) or "none"
        raise InputError(
            f"{network.owner} acts otherwise than by its library's predict on "
            f"{int(is_other.sum())} of {len(pixels)} frames; the wrappers of its environment that "
            f"change observations are: {names}; give drone_rl.policy_from transforms= that make "
            "the same observations, or leave them out, and wrappers whose result depends on the "
            "current observation alone"
        )


def _fly(env: Any, actor: TensorDictModuleBase) -> list[tuple[Tensor, Tensor]]:
    """Return camera frames and observations of the start of an episode, for each environment."""
    base, frames, seen = base_env(env), [], []
    run = steps(
        ActorAgent(actor),
        base.observer,
        base.start(),
        num_steps=_STEPS,
        goes_on=lambda step: torch.ones_like(step.context.starts),
    )
    for step in run:
        frames.append(step.context.render())
        seen.append(step.context.observe())
    pairs = zip(torch.stack(frames, 1), torch.stack(seen, 1), strict=True)
    return [*pairs]
