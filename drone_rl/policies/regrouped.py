"""A network evaluated in batches of another composition, to see whether its outputs change."""

import torch
from torch import Tensor, nn

from drone_rl.policies.network import PictureNetwork
from drone_rl.policies.rounding import TOLERANCE
from drone_rl.utils.errors import InputError

REMEDY = (
    "give a callable without state, whose logits for a frame depend on no other frame of its batch"
)
"""What to do about a callable that acts by its batch."""


class Regrouped(PictureNetwork):
    """Gives each frame the outputs that the network gives it in another batch.

    A function of the frame does not notice.
    """

    def __init__(self, network: PictureNetwork, groups: str, seed: int = 0) -> None:
        """Takes a network.

        Args:
            network: Any.
            groups: "single": one frame a call. "mixed": the frames in random order, in groups of
                random sizes, each filled up with some of its frames again.
            seed: Of the order and the sizes.
        """
        super().__init__()
        self.network, self.groups = network, groups
        self.in_shape, self.actions = network.in_shape, network.actions
        self._generator = torch.Generator().manual_seed(seed)

    @property
    def parts(self) -> nn.Module:
        """Those of the network."""
        return self.network.parts

    def forward(self, pixels: Tensor) -> Tensor:
        """See `PictureNetwork`. Shapes: (N, C, H, W), (N, outputs)."""
        if self.groups == "single":
            return torch.cat([self.network(one) for one in pixels.split(1)])
        outputs = pixels.new_empty(len(pixels), self.num_actions)
        order = torch.randperm(len(pixels), generator=self._generator)
        while len(order):
            size = self._draw(len(order))
            rows, order = order[:size], order[size:]
            again = torch.randint(size, (self._draw(size + 1) - 1,), generator=self._generator)
            given = torch.cat([rows, rows[again]]).to(pixels.device)
            outputs[rows.to(pixels.device)] = self.network(pixels[given])[:size]
        return outputs

    def _draw(self, most: int) -> int:
        """A number from 1 to `most`, small ones more often."""
        share = float(torch.rand((), generator=self._generator))
        return min(most, 1 + int((most + 1) ** share - 1))


@torch.no_grad()
def require_same_in_any_batch(network: PictureNetwork, frames: Tensor, largest: int) -> None:
    """Evaluate frames in batches of many sizes.

    Args:
        network: From elsewhere.
        frames: Shape: (N, C, H, W).
        largest: A size that must be among them.

    Raises:
        InputError: The outputs depend on the size.
    """
    rows = torch.linspace(0, len(frames) - 1, min(len(frames), 64)).long().to(frames.device)
    frames = frames[rows]
    alone = torch.cat([network(frame) for frame in frames.split(1)])
    allowed = TOLERANCE * (1 + alone.abs().amax(-1))
    for size in sorted({*range(1, 65), 100, 128, 200, 250, 256, 400, 500, 512, 1000, largest}):
        which = (torch.arange(size, device=frames.device) + size) % len(frames)
        difference = (network(frames[which]) - alone[which]).abs().amax(-1)
        if bool((difference > allowed[which]).any()):
            raise InputError(
                f"{network.owner} gives other logits for the same frame in a batch of {size}: they "
                f"differ by {float(difference.max()):.3g}; {REMEDY}"
            )
