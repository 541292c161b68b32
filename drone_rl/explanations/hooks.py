"""Layers by name, and what comes out of them. No hook survives a call."""

import collections
from typing import Any

import torch
from torch import Tensor, nn

from drone_rl.policies import PictureNetwork
from drone_rl.sim.actions import MOVES, Actions
from drone_rl.utils.errors import InputError

BATCH = 512
"""Pictures in one forward pass, which bounds the memory."""
_TRIED = 2
"""Pictures by which layers are found."""


@torch.no_grad()
def _acting(network: PictureNetwork) -> dict[str, tuple[nn.Module, tuple[int, ...]]]:
    """Layers in the order in which they act on pictures, with the shape of what each makes.

    A layer has no layers within, acts once, and makes one tensor.
    """
    names = {part: name for name, part in network.parts.named_modules() if name}
    acted: list[tuple[nn.Module, tuple[int, ...]]] = []

    def note(layer: nn.Module, _: Any, out: Any) -> None:
        whole = isinstance(out, Tensor) and out.shape[:1] == (_TRIED,)
        acted.append((layer, tuple(out.shape[1:]) if whole else ()))

    leaves = [p for p in names if not [*p.children()] and not isinstance(p, nn.Sequential)]
    handles = [leaf.register_forward_hook(note) for leaf in leaves]
    try:
        device = next((p.device for p in network.parameters()), torch.device("cpu"))
        network(torch.zeros(_TRIED, *network.in_shape, device=device))
    finally:
        for handle in handles:
            handle.remove()
    times = collections.Counter(layer for layer, _ in acted)
    return {names[layer]: (layer, made) for layer, made in acted if made and times[layer] == 1}


def layer_names(network: PictureNetwork) -> list[str]:
    """Names of the layers, in order; none of a callable that is no torch module."""
    return [*_acting(network)]


def find_layer(network: PictureNetwork, name: str) -> nn.Module:
    """The layer of that name.

    Raises:
        InputError: There is none; those that exist are listed.
    """
    found = dict(network.parts.named_modules()).get(name) if name else None
    if found is None or [*found.children()]:
        there = ", ".join(layer_names(network)) or "none, for it is no torch module"
        raise InputError(f"layer={name} is not in the policy; choose from: {there}")
    return found


def spatial_layers(network: PictureNetwork) -> list[str]:
    """Layers whose output is a feature map, in order; none in an MLP.

    Each is what comes right after a convolution and keeps its shape, its nonlinearity as a rule, or
    else the convolution itself.
    """
    acting = [*_acting(network).items()]
    found = []
    for i, (name, (layer, made)) in enumerate(acting):
        if isinstance(layer, nn.Conv2d):
            after, (_, then) = acting[i + 1] if i + 1 < len(acting) else ("", (None, ()))
            found.append(after if then == made else name)
    return found


def feature_layer(network: PictureNetwork) -> str | None:
    """The last layer before the logits: what the policy knows of a picture; None if it has none."""
    names = layer_names(network)
    return names[-2] if len(names) > 1 else None


@torch.no_grad()
def features(network: PictureNetwork, observations: Tensor, layer: str) -> Tensor:
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
def outputs(network: PictureNetwork, observations: Tensor) -> Tensor:
    """What the network gives. Shape: (T, C, H, W) to (T, number of outputs)."""
    return torch.cat([network(part) for part in observations.split(BATCH)])


@torch.no_grad()
def probabilities(network: PictureNetwork, observations: Tensor) -> Tensor:
    """What the policy wishes for (Eq. 9). Shape: (T, C, H, W) to (T, number of parts)."""
    return actions_of(network).wish(outputs(network, observations))


def actions_of(network: nn.Module) -> Actions:
    """What a network's outputs ask for: the chapter's moves where it is none of ours."""
    return network.actions if isinstance(network, PictureNetwork) else MOVES
