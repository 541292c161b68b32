"""A network evaluated in batches of another composition, to see whether its outputs change."""

import torch
from torch import Tensor, nn

from drone_rl.policies.network import PictureNetwork


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
