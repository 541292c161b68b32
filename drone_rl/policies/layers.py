"""The layers of a network, for code that computes with its weights: kernels, bounds and proofs."""

import typing
from typing import Any, NamedTuple

from torch import nn

from drone_rl.policies.networks import InputsNetwork, PolicyNetwork

Layer = nn.Conv2d | nn.Linear | nn.MaxPool2d | nn.ReLU | nn.Flatten
"""Convolutions without padding, linear layers, both with biases, pooling of squares that do not
overlap, ReLU, and Flatten of a frame."""


class Branch(NamedTuple):
    """The layers that see one input, up to its flattened features."""

    key: str
    """Name of the input, or "vectors" for all vectors."""
    in_shape: tuple[int, ...]
    """Shape of the input, (C, H, W), or of all vectors, (n,)."""
    layers: tuple[Layer, ...]
    """The last one is Flatten, unless they see vectors."""


class Layers(NamedTuple):
    """A network whose outputs are those of these layers."""

    branches: tuple[Branch, ...]
    """One for each input; their features are joined in this order."""
    trunk: tuple[Layer, ...]
    """From the features to the outputs; the last one is linear."""

    @property
    def in_turn(self) -> tuple[Layer, ...]:
        """All layers of a network with one input."""
        (branch,) = self.branches
        return branch.layers + self.trunk


class Unsupported(NamedTuple):
    """A network that has no such layers."""

    reason: str
    """What it has, such as "network MyNet overrides forward"."""


def as_layers(network: nn.Module, *, several: bool = False) -> Layers | Unsupported:
    """Return the layers of a network, or the first reason why it has others than `Layer`.

    With `several`, networks of several inputs have layers, too.
    """
    name = type(network).__name__
    if several and type(network) is InputsNetwork:
        return _of_inputs(network)
    if not isinstance(network, PolicyNetwork):
        return Unsupported(f"network {name} is no PolicyNetwork")
    if type(network).forward is not PolicyNetwork.forward:
        return Unsupported(f"network {name} overrides forward")
    layers: tuple[Layer, ...] = tuple(network.layers)  # pyright: ignore[reportAssignmentType]
    if strange := [layer for layer in layers if not _is_plain(layer)]:
        return Unsupported(f"network {name} has the layer {strange[0]}")
    kinds = [*map(type, layers)]
    if nn.Flatten not in kinds or kinds[-1] is not nn.Linear:
        return Unsupported(f"network {name} does not end in flattened features and a linear layer")
    end = kinds.index(nn.Flatten) + 1
    return Layers((Branch("pixels", network.in_shape, layers[:end]),), layers[end:])


def _of_inputs(network: InputsNetwork) -> Layers | Unsupported:
    """Return the layers of a network of several inputs."""
    shapes = dict(network.in_shapes)
    images = [name for name, shape in shapes.items() if len(shape) > 1]
    shapes["vectors"] = (sum(shape[0] for shape in shapes.values() if len(shape) == 1),)
    names = [*images, "vectors"] if "vectors" in network.branches else images
    parts: Any = {name: tuple(network.branches[name]) for name in names}  # pyright: ignore[reportArgumentType]
    if strange := [layer for layers in parts.values() for layer in layers if not _is_plain(layer)]:
        return Unsupported(f"network {type(network).__name__} has the layer {strange[0]}")
    branches = tuple(Branch(name, shapes[name], layers) for name, layers in parts.items())
    trunk: Any = tuple(network.layers)
    return Layers(branches, trunk)


def _is_plain(layer: nn.Module) -> bool:
    """Return whether a layer is one of `Layer`; derived classes may compute something else."""
    if type(layer) not in typing.get_args(Layer):
        return False
    match layer:
        case nn.Conv2d():
            options = (layer.padding, layer.dilation, layer.groups)
            return options == ((0, 0), (1, 1), 1) and _has_own_weights(layer)
        case nn.Linear():
            return _has_own_weights(layer)
        case nn.MaxPool2d():
            options = (layer.padding, layer.dilation, layer.ceil_mode, layer.return_indices)
            is_square = isinstance(layer.kernel_size, int) and layer.stride == layer.kernel_size
            return is_square and options == (0, 1, False, False)
        case nn.Flatten():
            return (layer.start_dim, layer.end_dim) == (1, -1)
    return True


def _has_own_weights(layer: nn.Module) -> bool:
    """Return whether weight and bias are a layer's parameters, not computed from others."""
    return {name for name, _ in layer.named_parameters(recurse=False)} == {"weight", "bias"}
