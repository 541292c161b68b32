"""Layers of a network by name, and their outputs. No hook remains after a call."""

import collections
from typing import Any, cast

import torch
from captum.attr import LayerActivation
from torch import Tensor, nn

from drone_rl.policies import ImageNetwork
from drone_rl.utils.errors import InputError

BATCH = 512  # observations in one forward pass, which bounds memory
_TRIED = 2  # observations in the forward pass that finds the layers


@torch.no_grad()
def layers(network: ImageNetwork) -> dict[str, tuple[nn.Module, tuple[int, ...]]]:
    """Return layers by name in the order of the forward pass, with the shapes of their outputs.

    A layer has no submodules, runs once, and returns one tensor. Third-party callables have none.
    """
    names = {part: name for name, part in network.parts.named_modules() if name}
    ran: list[tuple[nn.Module, tuple[int, ...]]] = []

    def note(layer: nn.Module, _: Any, out: Any) -> None:
        is_whole = isinstance(out, Tensor) and out.shape[:1] == (_TRIED,)
        ran.append((layer, tuple(out.shape[1:]) if is_whole else ()))

    leaves = [p for p in names if not [*p.children()] and not isinstance(p, nn.Sequential)]
    handles = [leaf.register_forward_hook(note) for leaf in leaves]
    try:
        device = next((p.device for p in network.parameters()), torch.device("cpu"))
        network(torch.zeros(_TRIED, *network.in_shape, device=device))
    finally:
        for handle in handles:
            handle.remove()
    times = collections.Counter(layer for layer, _ in ran)
    return {names[layer]: (layer, shape) for layer, shape in ran if shape and times[layer] == 1}


def find_layer(network: ImageNetwork, name: str) -> nn.Module:
    """Return one of `layers` by name; if there is none, raise InputError with those that exist."""
    by_name = layers(network)
    if name not in by_name:
        names = ", ".join(by_name) or "none"
        raise InputError(f"layer={name} is not in the policy; choose from: {names}")
    return by_name[name][0]


def spatial_layers(network: ImageNetwork) -> list[str]:
    """Return layers with a feature map, in order; none in an MLP.

    For each convolution: the next layer if that keeps the shape and is no convolution, else itself.
    """
    every, names = [*layers(network).items()], []
    for i, (name, (layer, shape)) in enumerate(every):
        if isinstance(layer, nn.Conv2d):
            after, (next_layer, then) = every[i + 1] if i + 1 < len(every) else ("", (None, ()))
            is_kept = then == shape and not isinstance(next_layer, nn.Conv2d)
            names.append(after if is_kept else name)
    return names


def feature_layer(network: ImageNetwork) -> str | None:
    """Return the last layer before the logits; None if there is none."""
    names = [*layers(network)]
    return names[-2] if len(names) > 1 else None


@torch.no_grad()
def features(network: ImageNetwork, observations: Tensor, layer: str) -> Tensor:
    """Return a layer's output (T, *) on observations (T, C, h, w); see `find_layer` for errors."""
    method = LayerActivation(network, find_layer(network, layer))
    return torch.cat([cast(Tensor, method.attribute(part)) for part in observations.split(BATCH)])


@torch.no_grad()
def probabilities(network: ImageNetwork, observations: Tensor) -> Tensor:
    """Return action probabilities (Eq. 9). (T, C, h, w) to (T, parts), see `Actions`."""
    outputs = torch.cat([network(part) for part in observations.split(BATCH)])
    return network.actions.probabilities(outputs)
