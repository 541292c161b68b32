"""Convolutional policy networks. Layers are named: explanations address them by name."""

from collections import OrderedDict
from collections.abc import Callable, Sequence

import torch
from torch import Tensor, nn

from drone_rl.config.networks import OriginalCnn, SmallCnn
from drone_rl.config.registry import implements
from drone_rl.policies.finite import require_finite
from drone_rl.policies.network import PictureNetwork
from drone_rl.utils.errors import InputError

Weighted = nn.Conv2d | nn.Linear
"""Layers that are initialised."""


class PolicyNetwork(PictureNetwork):
    """Layers from a picture to one logit an action, of which the last is linear: "logits"."""

    def __init__(
        self,
        in_shape: Sequence[int],
        layers: "OrderedDict[str, nn.Module]",
        initialise: Callable[[Weighted, bool], None],
    ) -> None:
        """Wraps and initialises the layers.

        Args:
            in_shape: Shape (C, H, W) of one picture.
            layers: By name, in order.
            initialise: Called with each convolution and linear layer, and whether it is the last.
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
    def num_actions(self) -> int:
        """Number of outputs: logits, where actions are counted."""
        return len(self.layers.get_parameter("logits.weight"))

    @property
    def parts(self) -> nn.Module:
        """The layers."""
        return self.layers

    @torch.no_grad()
    def rescale(self, factor: Tensor, shift: Tensor) -> None:
        """See `PictureNetwork`; the last layer changes."""
        weight, bias = (self.layers.get_parameter(f"logits.{n}") for n in ("weight", "bias"))
        weight.mul_(factor[:, None])
        bias.mul_(factor).add_(shift)

    def check(self, pixels: Tensor) -> None:
        """Refuses pictures of another shape.

        Raises:
            InputError: They are.
        """
        if tuple(pixels.shape[-3:]) != self.in_shape:
            raise InputError(
                f"the policy was built for pictures of shape {self.in_shape}, not "
                f"{tuple(pixels.shape[-3:])}; use the camera and transforms it was trained with"
            )

    def forward(self, pixels: Tensor) -> Tensor:
        """See `PictureNetwork`.

        Raises:
            InputError: The pictures are of another shape or, unless gradients are recorded, an
                output is not finite.
        """
        self.check(pixels)
        logits = self.layers(pixels.reshape(-1, *self.in_shape))
        if not (torch.is_grad_enabled() or torch.compiler.is_compiling()):
            require_finite(logits, self.owner)
        return logits.reshape(*pixels.shape[:-3], logits.shape[-1])


@implements(OriginalCnn)
class OriginalCNN(PolicyNetwork):
    """The original study's network: two convolutions with pooling and three linear layers."""

    def __init__(
        self,
        in_shape: Sequence[int],
        num_actions: int,
        *,
        channels: Sequence[int] = OriginalCnn.channels,
        hidden: Sequence[int] = OriginalCnn.hidden,
        generator: torch.Generator | None = None,
    ) -> None:
        """Builds and initialises it (He-normal convolutions, Xavier-normal linear layers).

        Args:
            in_shape: Shape (C, H, W) of one picture.
            num_actions: Number of logits.
            channels: Output channels of the convolutions.
            hidden: Widths of the linear layers but the last.
            generator: Source of the initial weights.

        Raises:
            InputError: The picture is too small.
        """
        convolutions: OrderedDict[str, nn.Module] = OrderedDict()
        before = in_shape[0]
        for i, after in enumerate(channels, start=1):
            convolutions[f"conv{i}"] = nn.Conv2d(before, after, 5)
            convolutions[f"relu{i}"] = nn.ReLU()
            convolutions[f"pool{i}"] = nn.MaxPool2d(2)
            before = after

        def initialise(layer: Weighted, is_last: bool) -> None:
            del is_last
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
    """Patches, one convolution and two linear layers: learns as well at a tenth of the cost."""

    def __init__(
        self,
        in_shape: Sequence[int],
        num_actions: int,
        *,
        patch: int = SmallCnn.patch,
        channels: Sequence[int] = SmallCnn.channels,
        hidden: Sequence[int] = SmallCnn.hidden,
        generator: torch.Generator | None = None,
    ) -> None:
        """Builds and initialises it: orthogonal, the logits near zero (a uniform first policy).

        Args:
            in_shape: Shape (C, H, W) of one picture.
            num_actions: Number of logits.
            patch: Size and stride, in pixels, of the first convolution.
            channels: Output channels of the convolutions; all after the first are 3x3.
            hidden: Widths of the linear layers but the last.
            generator: Source of the initial weights.

        Raises:
            InputError: The picture is too small.
        """
        convolutions: OrderedDict[str, nn.Module] = OrderedDict()
        before = in_shape[0]
        for i, after in enumerate(channels, start=1):
            kernel, stride = (patch, patch) if i == 1 else (3, 1)
            convolutions[f"conv{i}"] = nn.Conv2d(before, after, kernel, stride)
            convolutions[f"relu{i}"] = nn.ReLU()
            before = after
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
    """Adds linear layers, sized by what the convolutions make of a picture."""
    layers = OrderedDict(convolutions)
    width = _flat_size(convolutions, in_shape)
    layers["flatten"] = nn.Flatten()
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
            f"a picture of {height}x{width} pixels is too small for the network; give at least "
            f"{smallest}x{smallest} (camera.height, camera.width)"
        )
    filters = [m.out_channels for m in stack if isinstance(m, nn.Conv2d)]
    return (filters[-1] if filters else channels) * high * wide


def _left(stack: Sequence[nn.Conv2d | nn.MaxPool2d], size: int) -> int:
    """What square layers without padding leave of so many pixels; 0 or less where too few."""
    for layer in stack:
        kernel, stride = _side(layer.kernel_size), _side(layer.stride)
        size = (size - kernel) // stride + 1 if size >= kernel else 0
    return size


def _side(size: int | tuple[int, ...]) -> int:
    return size if isinstance(size, int) else size[0]
