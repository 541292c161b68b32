"""Policy networks: from observations to action logits.

Layers are named, and explanations address them by name. The registered networks take `in_shape`,
(C, H, W) of one frame, `num_actions`, the number of logits, sizes as in `config.networks`, and
`generator`, the source of their initial weights; they raise `InputError` if the frame is too small.
"""

import itertools
from collections import OrderedDict
from collections.abc import Callable, Mapping, Sequence

import torch
from tensordict.utils import NestedKey
from torch import Tensor, nn

from drone_rl.config.networks import Mlp, OriginalCnn, SmallCnn
from drone_rl.config.registry import implements
from drone_rl.sim.actions import MOVES, Actions
from drone_rl.utils.errors import InputError


class ImageNetwork(nn.Module):
    """Any network from frames to the parameters of the action distribution.

    For discrete actions these are logits, for continuous ones see `normal_of` in
    `drone_rl.sim.continuous_actions`. Frames may have any number of leading batch dimensions.
    """

    in_shape: tuple[int, ...]
    """Shape (C, H, W) of one frame."""
    actions: Actions = MOVES
    """The actions that the outputs parametrize."""
    owner: str = "the policy"
    """Name of the policy in error messages."""
    is_differentiable: bool = True
    """Whether the logits have gradients by the pixels."""
    in_keys: tuple[str, ...] = ("pixels",)
    """Entries of a batch that `forward` takes."""
    out_keys: tuple[NestedKey, ...] = ("logits",)
    """Entries of a batch that `forward` returns."""
    is_recurrent: bool = False
    """Whether outputs depend on earlier frames of the episode, too."""

    @property
    def num_actions(self) -> int:
        """Number of outputs, see `Actions.num_outputs`."""
        return self.actions.num_outputs

    @property
    def has_weights(self) -> bool:
        """Whether there are weights, which can be shuffled."""
        return any(True for _ in self.parameters())

    @property
    def parts(self) -> nn.Module:
        """The module whose layers are addressed by name."""
        return self

    def rescale(self, factor: Tensor, shift: Tensor) -> None:
        """Scale and shift the logits permanently. Shapes: (num_actions,)."""
        raise NotImplementedError

    def forward(self, pixels: Tensor) -> Tensor:
        """Frames (*, C, H, W) to logits (*, num_actions).

        Raises:
            InputError: The frames are of another shape than the network was built for.
        """
        raise NotImplementedError


Weighted = nn.Conv2d | nn.Linear
"""Layers with weights."""


class LayersNetwork(ImageNetwork):
    """A network that ends in the sequence `layers`, of which the last, "logits", is linear."""

    layers: nn.Sequential

    @property
    def num_actions(self) -> int:
        """Number of outputs, see `Actions.num_outputs`."""
        return len(self.layers.get_parameter("logits.weight"))

    @torch.no_grad()
    def rescale(self, factor: Tensor, shift: Tensor) -> None:
        """See `ImageNetwork`; the last layer changes."""
        weight, bias = (self.layers.get_parameter(f"logits.{n}") for n in ("weight", "bias"))
        weight.mul_(factor[:, None])
        bias.mul_(factor).add_(shift)


class PolicyNetwork(LayersNetwork):
    """Layers from a frame to logits; the last one is linear and named "logits"."""

    def __init__(
        self,
        in_shape: Sequence[int],
        layers: "OrderedDict[str, nn.Module]",
        initialise: Callable[[Weighted, bool], None],
    ) -> None:
        """Initialise layers by name, in order, for frames of shape (C, H, W).

        `initialise` is called with each convolution and linear layer, and whether it is the last.
        """
        super().__init__()
        self.in_shape = tuple(in_shape)
        self.layers = nn.Sequential(layers)
        for layer in self.layers:
            if isinstance(layer, Weighted):
                initialise(layer, layer is self.layers[-1])
        # twice as fast on a CPU; torch's annotations lack it
        self.layers.to(memory_format=torch.channels_last)  # pyright: ignore[reportCallIssue]

    @property
    def parts(self) -> nn.Module:
        """The layers."""
        return self.layers

    @property
    def is_sequential(self) -> bool:
        """Whether the outputs are those of `layers` in turn: no class overrides `forward`."""
        return type(self).forward is PolicyNetwork.forward

    def check(self, pixels: Tensor) -> None:
        """Raise an `InputError` for frames of another shape than the network's."""
        check_shape(pixels, self.in_shape)

    def forward(self, pixels: Tensor) -> Tensor:
        """See `ImageNetwork`.

        Raises:
            InputError: The shape of frames differs or, without gradients, an output is not finite.
        """
        self.check(pixels)
        logits = self.layers(pixels.reshape(-1, *self.in_shape))
        if not (torch.is_grad_enabled() or torch.compiler.is_compiling()):
            require_finite(logits, self.owner)
        return logits.reshape(*pixels.shape[:-3], logits.shape[-1])


class InputsNetwork(LayersNetwork):
    """A network of several inputs, joined: layers for each image, one for all vectors, and a trunk.

    Initial weights are orthogonal, the logits near zero.
    """

    def __init__(
        self,
        in_shapes: Mapping[str, Sequence[int]],
        images: Mapping[str, PolicyNetwork],
        num_actions: int,
        *,
        hidden: Sequence[int],
        generator: torch.Generator | None = None,
    ) -> None:
        """Take the shapes of inputs, and networks of the images, whose layers up to Flatten remain.

        Args:
            in_shapes: Of each input by name: (C, H, W) of an image, (n,) of a vector.
            images: A network of each image, by its name.
            num_actions: Number of logits.
            hidden: Widths of the trunk's layers before the logits.
            generator: Source of the initial weights.
        """
        super().__init__()
        self.in_shapes = {name: tuple(shape) for name, shape in in_shapes.items()}
        self.in_keys = tuple(self.in_shapes)
        self.in_shape = self.in_shapes[next(iter(images), self.in_keys[0])]
        self.branches = nn.ModuleDict()
        vectors = sum(shape[0] for shape in self.in_shapes.values() if len(shape) == 1)
        width = VECTOR_FEATURES if vectors else 0
        for name, network in images.items():
            kinds = [*map(type, network.layers)]
            end = kinds.index(nn.Flatten) + 1
            self.branches[name] = network.layers[:end]
            width += network.layers[:end](torch.zeros(1, *network.in_shape)).shape[1]
        initialise = orthogonal(generator)
        if vectors:
            self.branches["vectors"] = nn.Sequential(nn.Linear(vectors, VECTOR_FEATURES), nn.ReLU())
            initialise(self.branches["vectors"][0], False)  # pyright: ignore[reportIndexIssue]
        self.layers = nn.Sequential(_linear(width, hidden, num_actions))
        for layer in self.layers:
            if isinstance(layer, nn.Linear):
                initialise(layer, layer is self.layers[-1])

    def check(self, *inputs: Tensor) -> None:
        """Raise an `InputError` for an input of another shape than the network's."""
        for (name, shape), values in zip(self.in_shapes.items(), inputs, strict=True):
            if (found := tuple(values.shape[-len(shape) :])) != shape:
                raise InputError(
                    f"the policy was built for {name} of shape {shape}, not {found}; give the "
                    "inputs that it was trained with"
                )

    def features(self, *inputs: Tensor) -> Tensor:
        """Return the joined outputs of all branches. Shapes: (N, *) to (N, F)."""
        self.check(*inputs)
        seen, vectors = [], []
        for (name, shape), values in zip(self.in_shapes.items(), inputs, strict=True):
            if len(shape) == 1:
                vectors.append(values)
            else:
                seen.append(self.branches[name](values))
        if vectors:
            seen.append(self.branches["vectors"](torch.cat(vectors, -1)))
        return torch.cat(seen, -1)

    def forward(self, *inputs: Tensor) -> Tensor:  # pyright: ignore[reportIncompatibleMethodOverride]
        """Inputs in the order of `in_keys`, each (*, its shape), to logits (*, num_actions).

        Raises:
            InputError: An input has another shape or, without gradients, an output is not finite.
        """
        shapes = self.in_shapes.values()
        if len(inputs) != len(shapes):
            raise InputError(
                f"the policy reads {', '.join(self.in_keys)}, and got {len(inputs)} of them"
            )
        batch = inputs[0].shape[: inputs[0].ndim - len(self.in_shapes[self.in_keys[0]])]
        flat = [v.reshape(-1, *v.shape[len(batch) :]) for v in inputs]
        logits = self.layers(self.features(*flat))
        if not (torch.is_grad_enabled() or torch.compiler.is_compiling()):
            require_finite(logits, self.owner)
        return logits.reshape(*batch, logits.shape[-1])


VECTOR_FEATURES = 64
"""Width of the layer that takes all vectors."""


class InputsTrunk(nn.Module):
    """An `InputsNetwork` without its last layer: inputs (N, *) to features (N, F)."""

    def __init__(self, network: InputsNetwork) -> None:
        super().__init__()
        self._features, self.branches = network.features, network.branches
        self.layers = network.layers[:-1]

    def forward(self, *inputs: Tensor) -> Tensor:
        """Return the features."""
        return self.layers(self._features(*inputs))


class Trunk(nn.Module):
    """A policy network without its last layer: frames (*, C, H, W) to features (*, F)."""

    def __init__(self, network: PolicyNetwork) -> None:
        super().__init__()
        self.in_shape = network.in_shape
        self.layers = network.layers[:-1]

    def forward(self, pixels: Tensor) -> Tensor:
        """Return the features of frames."""
        features = self.layers(pixels.reshape(-1, *self.in_shape))
        return features.reshape(*pixels.shape[:-3], features.shape[-1])


def check_shape(pixels: Tensor, in_shape: tuple[int, ...]) -> None:
    """Raise an `InputError` for frames of another shape (C, H, W)."""
    if tuple(pixels.shape[-3:]) != in_shape:
        raise InputError(
            f"the policy was built for images of shape {in_shape}, not "
            f"{tuple(pixels.shape[-3:])}; use the camera and transforms it was trained with"
        )


@implements(OriginalCnn)
class OriginalCNN(PolicyNetwork):
    """The original study's network: two convolutions with pooling and three linear layers.

    Initial weights: He-normal convolutions, Xavier-normal linear layers.
    """

    def __init__(
        self,
        in_shape: Sequence[int],
        num_actions: int,
        *,
        channels: Sequence[int] = OriginalCnn().channels,
        hidden: Sequence[int] = OriginalCnn().hidden,
        generator: torch.Generator | None = None,
    ) -> None:
        convolutions: OrderedDict[str, nn.Module] = OrderedDict()
        for i, (before, after) in enumerate(itertools.pairwise([in_shape[0], *channels]), start=1):
            convolutions[f"conv{i}"] = nn.Conv2d(before, after, 5)
            convolutions[f"relu{i}"] = nn.ReLU()
            convolutions[f"pool{i}"] = nn.MaxPool2d(2)

        def initialise(layer: Weighted, is_last: bool) -> None:
            if isinstance(layer, nn.Conv2d):
                nn.init.kaiming_normal_(layer.weight, nonlinearity="relu", generator=generator)
            else:
                nn.init.xavier_normal_(layer.weight, generator=generator)
            if layer.bias is not None:
                nn.init.zeros_(layer.bias)

        layers = _with_head(convolutions, in_shape, hidden, num_actions)
        super().__init__(in_shape, layers, initialise)


@implements(SmallCnn)
class SmallCNN(PolicyNetwork):
    """A patch convolution, 3x3 convolutions and linear layers.

    Initial weights are orthogonal, the logits near zero (a uniform first policy).
    """

    def __init__(
        self,
        in_shape: Sequence[int],
        num_actions: int,
        *,
        patch: int = SmallCnn().patch,
        channels: Sequence[int] = SmallCnn().channels,
        hidden: Sequence[int] = SmallCnn().hidden,
        generator: torch.Generator | None = None,
    ) -> None:
        convolutions: OrderedDict[str, nn.Module] = OrderedDict()
        for i, (before, after) in enumerate(itertools.pairwise([in_shape[0], *channels]), start=1):
            kernel, stride = (patch, patch) if i == 1 else (3, 1)
            convolutions[f"conv{i}"] = nn.Conv2d(before, after, kernel, stride)
            convolutions[f"relu{i}"] = nn.ReLU()
        layers = _with_head(convolutions, in_shape, hidden, num_actions)
        super().__init__(in_shape, layers, orthogonal(generator))


def orthogonal(generator: torch.Generator | None) -> Callable[[Weighted, bool], None]:
    """Orthogonal weights of gain sqrt(2), of gain 0.01 for the last layer; zero biases."""

    def initialise(layer: Weighted, is_last: bool) -> None:
        nn.init.orthogonal_(layer.weight, 0.01 if is_last else 2**0.5, generator=generator)
        if layer.bias is not None:
            nn.init.zeros_(layer.bias)

    return initialise


def _with_head(
    convolutions: "OrderedDict[str, nn.Module]",
    in_shape: Sequence[int],
    hidden: Sequence[int],
    num_actions: int,
) -> "OrderedDict[str, nn.Module]":
    """Add linear layers to convolutions."""
    layers = OrderedDict(convolutions)
    width = _flat_size(convolutions, in_shape)
    layers["flatten"] = nn.Flatten()
    layers.update(_linear(width, hidden, num_actions))
    return layers


def _linear(width: int, hidden: Sequence[int], num_actions: int) -> "OrderedDict[str, nn.Module]":
    """Return linear layers from `width` features to logits."""
    layers: OrderedDict[str, nn.Module] = OrderedDict()
    for i, size in enumerate(hidden, start=1):
        layers[f"fc{i}"] = nn.Linear(width, size)
        layers[f"fc_relu{i}"] = nn.ReLU()
        width = size
    layers["logits"] = nn.Linear(width, num_actions)
    return layers


def _flat_size(convolutions: "OrderedDict[str, nn.Module]", in_shape: Sequence[int]) -> int:
    channels, height, width = in_shape
    stack = [m for m in convolutions.values() if isinstance(m, nn.Conv2d | nn.MaxPool2d)]
    high, wide = _left(stack, height), _left(stack, width)
    if high < 1 or wide < 1:
        smallest = next(s for s in range(1, 10_000) if _left(stack, s) >= 1)
        raise InputError(
            f"an image of {height}x{width} pixels is too small for the network; give at least "
            f"{smallest}x{smallest} (camera.height, camera.width)"
        )
    filters = [m.out_channels for m in stack if isinstance(m, nn.Conv2d)]
    return (filters[-1] if filters else channels) * high * wide


def _left(stack: Sequence[nn.Conv2d | nn.MaxPool2d], size: int) -> int:
    """Return the output size of square layers without padding; 0 if the input is too small."""
    for layer in stack:
        kernel, stride = _side(layer.kernel_size), _side(layer.stride)
        size = (size - kernel) // stride + 1 if size >= kernel else 0
    return size


def _side(size: int | tuple[int, ...]) -> int:
    return size if isinstance(size, int) else size[0]


@implements(Mlp)
class MLP(PolicyNetwork):
    """Linear layers on the flattened frame, initialised like `SmallCNN`."""

    def __init__(
        self,
        in_shape: Sequence[int],
        num_actions: int,
        *,
        hidden: Sequence[int] = Mlp().hidden,
        generator: torch.Generator | None = None,
    ) -> None:
        layers = _with_head(OrderedDict(), in_shape, hidden, num_actions)
        super().__init__(in_shape, layers, orthogonal(generator))


def require_finite(outputs: Tensor, owner: str = "the policy") -> None:
    """Raise an `InputError` about `owner`, a policy, if an output is infinite or NaN."""
    if not bool(outputs.isfinite().all()):
        raise InputError(
            f"{owner} gives non-finite action logits; its weights are too large for float32, so "
            "train it again or give another policy"
        )
