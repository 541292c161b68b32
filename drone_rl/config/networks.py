"""Settings of a policy's network."""

from typing import Annotated

from drone_rl.config.parts import Part
from drone_rl.utils.schema import Several, Whole

Channels = Annotated[tuple[int, ...], Several(Whole(1, 512, "channels"), 1, 8)]
Widths = Annotated[tuple[int, ...], Several(Whole(1, 4096, "neurons"), 0, 8)]


class Network(Part):
    """Settings of a network."""


class SmallCnn(Network, target="small_cnn"):
    """Network for small images: two convolutions without pooling."""

    patch: Annotated[int, Whole(1, 64, "pixels")] = 4
    """Size and stride of the first convolution, pixels."""
    channels: Channels = (16, 32)
    """Output channels of the convolutions."""
    hidden: Widths = (128,)
    """Widths of the linear layers before the logits."""


class OriginalCnn(Network, target="original_cnn"):
    """The original study's network."""

    channels: Channels = (6, 16)
    """Output channels of the 5x5 convolutions, each followed by pooling."""
    hidden: Widths = (120, 84)
    """Widths of the linear layers before the logits."""


class Lstm(Network, target="lstm"):
    """A recurrent network: the layers of small_cnn and an LSTM, which remembers earlier images."""

    patch: Annotated[int, Whole(1, 64, "pixels")] = 4
    """Size and stride of the first convolution, pixels."""
    channels: Channels = (16, 32)
    """Output channels of the convolutions."""
    hidden: Widths = (64,)
    """Widths of the linear layers before the LSTM."""
    memory: Annotated[int, Whole(1, 1024, "numbers")] = 64
    """Size of the LSTM's state."""


class Mlp(Network, target="mlp"):
    """Linear layers on the flattened image."""

    hidden: Widths = (128, 64)
    """Widths of the linear layers before the logits."""
