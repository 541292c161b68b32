"""Use `drone_rl.acceleration` if it supports a configuration.

This is the only module that imports that package. TorchRL and PyTorch do what it does not support.
"""

from collections.abc import Iterable, Sequence
from typing import Literal, TypeVar

from tensordict.nn import TensorDictModuleBase
from tensordict.utils import NestedKey
from torch import nn
from torchrl.envs import EnvBase

from drone_rl.acceleration import (
    ActivationRecorder,
    DirectCollector,
    DirectStepper,
    FusedCollector,
    FusedNetwork,
)
from drone_rl.envs.direct_renderer import DirectRenderer, Reasons

N = TypeVar("N", bound=nn.Module)
Acceleration = Literal["none", "direct", "fused"]
"""Implementation. "none": step with TorchRL. "direct": step without it, bit-identical. "fused": one
kernel per batch of episodes; sampling and sums are in another order."""


def accelerated_collector(
    env: EnvBase,
    actor: TensorDictModuleBase,
    acceleration: Acceleration,
    *,
    next_keys: Iterable[NestedKey],
    actor_keys: Iterable[NestedKey] = (),
    keep_actor_entries: bool = True,
    num_threads: int = 1,
) -> FusedCollector | DirectCollector | Reasons:
    """Return an accelerated collector of complete episodes, or the reasons why there is none.

    Args:
        env: A batch of environments.
        actor: The policy.
        acceleration: The fastest implementation that may be used.
        next_keys: ("next", ...) entries to keep of each step.
        actor_keys: Entries that the actor reads or writes, to keep in addition to the action.
        keep_actor_entries: Whether to keep all entries that the actor reads and writes.
        num_threads: Threads of the fused kernel; no result depends on it.
    """
    if acceleration == "none":
        return Reasons(["acceleration is off"])
    renderer = DirectRenderer.try_create(env, actor.in_keys, next_keys)
    if isinstance(renderer, Reasons):
        return renderer
    direct = DirectCollector(renderer, actor, env.action_key, actor_keys, keep_actor_entries)
    if acceleration == "direct":
        return direct
    fused = FusedCollector.try_create(direct, num_threads)
    if isinstance(fused, Reasons):
        direct.reasons = fused
        return direct
    return fused


def accelerated_stepper(
    env: EnvBase, observed: Sequence[NestedKey], next_keys: Iterable[NestedKey]
) -> DirectStepper | Reasons:
    """Return an object that steps environments without TorchRL, or the reasons why there is none.

    `observed` are the entries that the actor reads, `next_keys` the ("next", ...) entries to keep.
    """
    if tuple(observed) != ("pixels",):
        return Reasons([f"the policy reads {', '.join(map(str, observed))} instead of pixels"])
    renderer = DirectRenderer.try_create(env, observed, next_keys)
    return renderer if isinstance(renderer, Reasons) else DirectStepper(renderer)


def accelerated_gradients(
    network: N,
    num_threads: int = 1,
    *,
    wrt: Literal["weights", "pixels"] = "weights",
    activations: ActivationRecorder | None = None,
) -> N | FusedNetwork:
    """Return the network with fused forward and backward pass if that is supported, else itself.

    See `FusedNetwork.try_create` for the arguments.
    """
    fused = FusedNetwork.try_create(network, num_threads, wrt=wrt, activations=activations)
    return network if isinstance(fused, Reasons) else fused
