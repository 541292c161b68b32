"""Layers by name, and what comes out of them. No hook survives a call."""

import torch
from torch import Tensor, nn

from drone_rl.policies import PolicyNetwork
from drone_rl.sim.actions import MOVES, Actions
from drone_rl.utils.errors import InputError

BATCH = 512
"""Pictures in one forward pass, which bounds the memory."""


def layer_names(network: PolicyNetwork) -> list[str]:
    """Names of the layers, in order."""
    return [name for name, _ in network.layers.named_children()]


def find_layer(network: PolicyNetwork, name: str) -> nn.Module:
    """The layer of that name.

    Raises:
        InputError: There is none; those that exist are listed.
    """
    names = layer_names(network)
    if name not in names:
        raise InputError(f"layer={name} is not in the policy; choose from: {', '.join(names)}")
    return getattr(network.layers, name)


def spatial_layers(network: PolicyNetwork) -> list[str]:
    """Layers whose output is a feature map after its nonlinearity, in order; none in an MLP."""
    names = layer_names(network)
    convolved = [n for n in names if isinstance(getattr(network.layers, n), nn.Conv2d)]
    return [names[names.index(name) + 1] for name in convolved]


def feature_layer(network: PolicyNetwork) -> str:
    """The last layer before the logits: what the policy knows of a picture."""
    return layer_names(network)[-2]


@torch.no_grad()
def features(network: PolicyNetwork, observations: Tensor, layer: str) -> Tensor:
    """What a layer makes of pictures.

    Args:
        network: The policy's.
        observations: Pictures (T, C, H, W) as the policy gets them.
        layer: Its name.

    Returns:
        Shape: (T, *), the layer's own.

    Raises:
        InputError: There is no such layer.
    """
    outputs: list[Tensor] = []
    module = find_layer(network, layer)
    handle = module.register_forward_hook(lambda _, __, out: outputs.append(out.detach().clone()))
    try:
        for part in observations.split(BATCH):
            network(part)
    finally:
        handle.remove()
    return torch.cat(outputs)


@torch.no_grad()
def probabilities(network: PolicyNetwork, observations: Tensor) -> Tensor:
    """What the policy wishes for (Eq. 9). Shape: (T, C, H, W) to (T, number of outputs)."""
    actions = actions_of(network)
    return torch.cat([actions.wish(network(part)) for part in observations.split(BATCH)])


def actions_of(network: nn.Module) -> Actions:
    """What a network's outputs ask for: the chapter's moves where it is none of ours."""
    return network.actions if isinstance(network, PolicyNetwork) else MOVES
