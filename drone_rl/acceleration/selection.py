"""Selects the fastest implementation that supports a configuration."""

from collections.abc import Callable, Iterable

from tensordict.nn import TensorDictModuleBase
from tensordict.utils import NestedKey
from torch import nn
from torchrl.envs import EnvBase

from drone_rl.acceleration.direct_collector import DirectCollector, DirectStream
from drone_rl.acceleration.fused_collector import FusedCollector
from drone_rl.acceleration.fused_network import ActivationCache, FusedNetwork, GradientsOf
from drone_rl.acceleration.inference_kernel import BatchedInference
from drone_rl.envs.direct_renderer import DirectRenderer, Reasons


def accelerate(
    env: EnvBase,
    actor: TensorDictModuleBase,
    *,
    kept: Iterable[NestedKey],
    extra: Iterable[NestedKey] = (),
    keep_observations: bool = True,
    fused: bool = True,
    num_threads: int = 1,
) -> FusedCollector | DirectCollector | Reasons:
    """Return an accelerated collector of complete episodes, or the reasons why there is none.

    Args:
        env: A batch of environments.
        actor: The policy.
        kept: ("next", ...) entries to keep of each step.
        extra: Entries that the actor writes, kept in addition to the action.
        keep_observations: Whether to keep observations and everything that the actor writes.
        fused: Whether the fused kernel may be used. It samples actions in another order and sums
            in another order than torch; the direct collector gives TorchRL's batches bit for bit.
        num_threads: Of the fused kernel; no result depends on it.
    """
    renderer = DirectRenderer.try_create(env, actor.in_keys, kept)
    if isinstance(renderer, Reasons):
        return renderer
    direct = DirectCollector(
        renderer, actor, env.action_key, extra=extra, keep_observations=keep_observations
    )
    if not fused:
        return direct
    found = FusedCollector.try_create(direct, num_threads)
    if isinstance(found, Reasons):
        direct.reasons = found
        return direct
    return found


def accelerate_stream(
    env: EnvBase, observed: Iterable[NestedKey], kept: Iterable[NestedKey]
) -> DirectStream | Reasons:
    """Return what steps environments on and on, or the reasons why TorchRL's steps are needed.

    Args:
        env: A batch of environments.
        observed: Entries that the actor reads.
        kept: ("next", ...) entries to keep of each step.
    """
    observed = tuple(observed)
    if observed != ("pixels",):
        return Reasons([f"the policy reads {', '.join(map(str, observed))} instead of pixels"])
    renderer = DirectRenderer.try_create(env, observed, kept)
    return renderer if isinstance(renderer, Reasons) else DirectStream(renderer)


def accelerate_gradients(
    network: nn.Module,
    num_threads: int = 1,
    *,
    of: GradientsOf = "weights",
    cache: Callable[[], ActivationCache | None] = lambda: None,
) -> FusedNetwork | Reasons:
    """Return the network with a fused forward and backward pass, or the reasons why not.

    Args:
        network: The policy network.
        num_threads: Sums over observations depend on it.
        of: What has gradients.
        cache: See `FusedNetwork.try_create`.
    """
    return FusedNetwork.try_create(network, num_threads, of=of, cache=cache)


def accelerate_inference(network: nn.Module) -> BatchedInference | Reasons:
    """Return a faster forward pass without gradients, or the reasons why not."""
    return BatchedInference.try_create(network)
