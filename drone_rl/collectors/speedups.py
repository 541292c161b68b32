"""Use `drone_rl.acceleration` if it supports a configuration.

This is the only module that imports that package. TorchRL and PyTorch do what it does not support.
"""

from typing import Any, Literal, TypeVar

from torch import nn

from drone_rl.acceleration import ActivationRecorder, FusedEpisodes, FusedNetwork
from drone_rl.acceleration import Reasons as Reasons
from drone_rl.envs import DroneEnv

N = TypeVar("N", bound=nn.Module)


def fused_episodes(
    env: DroneEnv, actor: Any, *, keeps_inputs: bool, num_threads: int
) -> FusedEpisodes | Reasons:
    """Return the kernel that runs an actor's episodes, or the reasons why there is none.

    See `FusedEpisodes` for the arguments.
    """
    return FusedEpisodes.try_create(env, actor, keeps_inputs, num_threads)


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
