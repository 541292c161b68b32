"""The self-check of third-party policies, on the first frames of episodes."""

from collections.abc import Callable, Iterable
from typing import Any

import torch
from tensordict import TensorDict
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
Predict = Callable[[Any], tuple[Tensor, Tensor]]
"""From the frames of an episode, RGB bytes (T, H, W, 3), or all inputs, a TensorDict (T,), to
actions (T,) and logits (T, A)."""


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
    inputs: Any = torch.cat([seen for _, seen in episodes])
    require_same_in_any_batch(network, inputs, _BATCH_SIZES)
    if predict is None:
        return
    theirs = [predict(frames) for frames, _ in episodes]
    actions, logits = (torch.cat(parts) for parts in zip(*theirs, strict=True))
    network_logits = _logits(network, inputs)
    is_other = (network_logits.softmax(-1) - logits.softmax(-1)).abs().amax(-1) > _PROBABILITY
    lead = network_logits.amax(-1) - network_logits.gather(1, actions[:, None])[:, 0]
    is_other |= lead > TOLERANCE * (1 + network_logits.abs().amax(-1))
    if is_other.any():
        names = ", ".join(wrappers) or "none"
        raise InputError(
            f"{network.owner} acts otherwise than by its library's predict on "
            f"{int(is_other.sum())} of {len(inputs)} frames; the wrappers of its environment that "
            f"change observations are: {names}; give drone_rl.policy_from transforms= that make "
            "the same observations, or leave them out, and wrappers whose result depends on the "
            "current observation alone"
        )


def _logits(network: ImageNetwork, inputs: TensorDict) -> Tensor:
    """Return the outputs for inputs (N,)."""
    return network(*(inputs[name] for name in network.in_keys))


def _fly(env: Any, actor: TensorDictModuleBase) -> list[tuple[Any, TensorDict]]:
    """Return what is observed at the start of an episode of each environment.

    That is camera frames, or all inputs if there are several, and the inputs, (T,).
    """
    base, frames, seen = base_env(env), [], []
    run = steps(
        ActorAgent(actor),
        base.observer,
        base.start(),
        num_steps=_STEPS,
        goes_on=lambda step: torch.ones_like(step.context.starts),
    )
    for step in run:
        inputs = TensorDict(step.context.inputs, [len(step.rows)])
        frames.append(step.context.render() if base.observer.sees_pixels else inputs)
        seen.append(inputs)
    pairs: Any = zip(torch.stack(frames, 1), torch.stack(seen, 1), strict=True)
    return [*pairs]


@torch.no_grad()
def require_same_in_any_batch(
    network: ImageNetwork, inputs: TensorDict, sizes: Iterable[int]
) -> None:
    """Raise an `InputError` if outputs for inputs, (N,), depend on the size of the batch."""
    rows = torch.linspace(0, len(inputs) - 1, min(len(inputs), 64)).long().to(inputs.device)
    inputs = inputs[rows]
    alone = torch.cat([_logits(network, one) for one in inputs.split(1)])
    allowed = TOLERANCE * (1 + alone.abs().amax(-1))
    for size in sizes:
        which = (torch.arange(size, device=inputs.device) + size) % len(inputs)
        difference = (_logits(network, inputs[which]) - alone[which]).abs().amax(-1)
        if bool((difference > allowed[which]).any()):
            raise InputError(
                f"{network.owner} gives other logits for the same frame in a batch of {size}: they "
                f"differ by {float(difference.max()):.3g}; give a callable without state, whose "
                "logits for a frame depend on no other frame of its batch"
            )
