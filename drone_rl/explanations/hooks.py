"""Layers of a network by name, and their outputs. No hook remains after a call.

Explanations take a policy as a function of one input, its observations, see `InputView`. `rest` is
what else it reads in each frame: the other inputs, flattened and side by side, (T, R); or the
memory of a recurrent policy, (T, 2, 1, size), hidden state and cell before each step. Without, the
other inputs are zeros, or each frame is the first of an episode.
"""

import collections
import functools
import math
from collections.abc import Iterator, Mapping
from typing import Any, cast

import torch
from captum.attr import LayerActivation
from torch import Tensor, nn

from drone_rl.policies import ImageNetwork
from drone_rl.policies.networks import InputsNetwork
from drone_rl.policies.recurrent import CELL, HIDDEN, Memory
from drone_rl.utils.errors import InputError

BATCH = 512  # observations in one forward pass, which bounds memory
_TRIED = 2  # observations in the forward pass that finds the layers


class InputView(ImageNetwork):
    """A policy of several inputs as a function of one of them; layers and weights are its own."""

    def __init__(self, network: InputsNetwork, name: str) -> None:
        """Take the policy's network, and the name of the input that comes first."""
        super().__init__()
        self.network, self.actions, self.owner = network, network.actions, network.owner
        self.in_keys = (name, *(key for key in network.in_keys if key != name))
        self.in_shape, *shapes = (network.in_shapes[key] for key in self.in_keys)
        self._shapes = shapes

    @property
    def parts(self) -> nn.Module:
        """The network."""
        return self.network

    def rescale(self, factor: Tensor, shift: Tensor) -> None:
        """See `ImageNetwork`."""
        self.network.rescale(factor, shift)

    def forward(self, *inputs: Tensor) -> Tensor:  # pyright: ignore[reportIncompatibleMethodOverride]
        """Inputs in the order of `in_keys` to outputs; those that are left out are zeros."""
        left_out = self._shapes[len(inputs) - 1 :]
        zeros = [inputs[0].new_zeros(len(inputs[0]), *shape) for shape in left_out]
        by_name = dict(zip(self.in_keys, [*inputs, *zeros], strict=True))
        return self.network(*(by_name[key] for key in self.network.in_keys))

    def unpacked(self, rest: Tensor) -> list[Tensor]:
        """Return the other inputs by themselves."""
        parts = rest.split([math.prod(shape) for shape in self._shapes], 1)
        return [part.unflatten(1, shape) for part, shape in zip(parts, self._shapes, strict=True)]


def of_input(network: ImageNetwork, name: str) -> ImageNetwork:
    """Return a policy as a function of one input; see `InputView`."""
    return InputView(network, name) if isinstance(network, InputsNetwork) else network


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
    Those of the policy's other images are left out.
    """
    others = tuple(f"branches.{key}." for key in network.in_keys[1:])
    every = [(n, one) for n, one in layers(network).items() if not n.startswith(others)]
    names = []
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


def rest_in(others: Mapping[str, Tensor]) -> Tensor | None:
    """Return other inputs, (T, *) by name, in order, flattened side by side; None if none."""
    return torch.cat([of.flatten(1) for of in others.values()], 1) if others else None


def entries_of(memory: Tensor) -> dict[Any, Tensor]:
    """Return a memory as what an actor reads."""
    hidden, cell = memory.unbind(1)
    return {HIDDEN: hidden, CELL: cell}


def evaluate(network: Any, observations: Tensor, rest: Tensor | None = None) -> Tensor:
    """Return the outputs of a network. Shape: (T, C, h, w) to (T, num_outputs)."""
    if rest is None:
        return network(observations)
    if isinstance(network, InputView):
        return network(observations, *network.unpacked(rest))
    return network.step(observations, Memory(*rest.unbind(1)))[0]


def batches(size: int, *values: Tensor | None) -> Iterator[list[Any]]:
    """Yield parts of at most `size` rows; None stays None."""
    for start in range(0, len(cast(Tensor, values[0])), size):
        yield [None if of is None else of[start : start + size] for of in values]


@torch.no_grad()
def features(
    network: ImageNetwork, observations: Tensor, layer: str, rest: Tensor | None = None
) -> Tensor:
    """Return a layer's output (T, *) on observations (T, C, h, w); see `find_layer` for errors."""
    method = LayerActivation(functools.partial(evaluate, network), find_layer(network, layer))
    parts = batches(BATCH, observations, rest)
    return torch.cat([cast(Tensor, method.attribute(x, r)) for x, r in parts])


@torch.no_grad()
def probabilities(
    network: ImageNetwork, observations: Tensor, rest: Tensor | None = None
) -> Tensor:
    """Return action probabilities (Eq. 9). (T, C, h, w) to (T, parts), see `Actions`."""
    parts = batches(BATCH, observations, rest)
    outputs = torch.cat([evaluate(network, *part) for part in parts])
    return network.actions.probabilities(outputs)
