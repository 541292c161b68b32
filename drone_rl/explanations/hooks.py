"""Layers of a network by name, and their outputs. No hook remains after a call.

Recurrent policies are evaluated step by step: `memory`, of shape (T, 2, 1, size), is hidden state
and cell before each step. Without, each frame is the first of an episode.
"""

import collections
import functools
from collections.abc import Iterator, Mapping
from typing import Any, cast

import torch
from captum.attr import LayerActivation
from torch import Tensor, nn

from drone_rl.policies import ImageNetwork
from drone_rl.policies.recurrent import CELL, HIDDEN, Memory
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


def memory_in(entries: Mapping[Any, Tensor]) -> Tensor | None:
    """Return the memory in what an actor reads; None of a policy that is not recurrent."""
    return torch.stack([entries[HIDDEN], entries[CELL]], 1) if HIDDEN in entries else None


def entries_of(memory: Tensor) -> dict[Any, Tensor]:
    """Return a memory as what an actor reads."""
    hidden, cell = memory.unbind(1)
    return {HIDDEN: hidden, CELL: cell}


def evaluate(network: Any, observations: Tensor, memory: Tensor | None = None) -> Tensor:
    """Return the outputs of a network. Shape: (T, C, h, w) to (T, num_outputs)."""
    if memory is None:
        return network(observations)
    return network.step(observations, Memory(*memory.unbind(1)))[0]


def batches(size: int, *values: Tensor | None) -> Iterator[list[Any]]:
    """Yield parts of at most `size` rows; None stays None."""
    for start in range(0, len(cast(Tensor, values[0])), size):
        yield [None if of is None else of[start : start + size] for of in values]


@torch.no_grad()
def features(
    network: ImageNetwork, observations: Tensor, layer: str, memory: Tensor | None = None
) -> Tensor:
    """Return a layer's output (T, *) on observations (T, C, h, w); see `find_layer` for errors."""
    method = LayerActivation(functools.partial(evaluate, network), find_layer(network, layer))
    parts = batches(BATCH, observations, memory)
    return torch.cat([cast(Tensor, method.attribute(x, m)) for x, m in parts])


@torch.no_grad()
def probabilities(
    network: ImageNetwork, observations: Tensor, memory: Tensor | None = None
) -> Tensor:
    """Return action probabilities (Eq. 9). (T, C, h, w) to (T, parts), see `Actions`."""
    parts = batches(BATCH, observations, memory)
    outputs = torch.cat([evaluate(network, *part) for part in parts])
    return network.actions.probabilities(outputs)
