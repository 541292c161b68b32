"""The self-check of third-party policies, on the first frames of episodes."""

from collections.abc import Callable, Iterable
from typing import Any

import torch
from tensordict.nn import TensorDictModuleBase
from torch import Tensor

from drone_rl.envs import base_env
from drone_rl.envs.rollout import ActorAgent, steps
from drone_rl.policies.networks import ImageNetwork
from drone_rl.policies.policy import BasePolicy
from drone_rl.utils.errors import InputError

_ENVIRONMENTS, _RESETS, _STEPS = 2, 2, 6
_BATCH_SIZES = (*range(1, 65), 100, 128, 200, 250, 256, 400, 500, 512, 1000)
"""Sizes of the batches in which the same frames are evaluated."""
TOLERANCE = 1e-4
"""Largest difference by rounding between logits of one frame, relative to 1 + the largest logit."""
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
    require_same_in_any_batch(network, pixels, _BATCH_SIZES)
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


@torch.no_grad()
def require_same_in_any_batch(network: ImageNetwork, frames: Tensor, sizes: Iterable[int]) -> None:
    """Raise an `InputError` if outputs for frames (N, C, H, W) depend on the size of the batch."""
    rows = torch.linspace(0, len(frames) - 1, min(len(frames), 64)).long().to(frames.device)
    frames = frames[rows]
    alone = torch.cat([network(frame) for frame in frames.split(1)])
    allowed = TOLERANCE * (1 + alone.abs().amax(-1))
    for size in sizes:
        which = (torch.arange(size, device=frames.device) + size) % len(frames)
        difference = (network(frames[which]) - alone[which]).abs().amax(-1)
        if bool((difference > allowed[which]).any()):
            raise InputError(
                f"{network.owner} gives other logits for the same frame in a batch of {size}: they "
                f"differ by {float(difference.max()):.3g}; give a callable without state, whose "
                "logits for a frame depend on no other frame of its batch"
            )
