# pyright: reportAttributeAccessIssue=false
# pyright: reportGeneralTypeIssues=false
# (Warp's structures are untyped.)
"""A network laid out for kernels, see `layers_kernel`."""

from collections.abc import Sequence
from typing import Self

import torch
import warp as wp
from torch import nn

from drone_rl.policies.layers_kernel import Layers
from drone_rl.policies.packed_layer import Order, PackedLayer, outputs_at, packed_layers


class PackedNetwork:
    """Convolutions of gray pictures, then linear layers, rectified in between."""

    def __init__(self, packed: Sequence[PackedLayer], num_pictures: int) -> None:
        """Lays it out; `find` tells whether that can be done.

        Args:
            packed: The layers.
            num_pictures: That are decided on together.
        """
        self._order = Order(packed)
        self.weights = torch.zeros(self._order.weights_at[-1])
        """As they are laid out."""
        steps, self.room = self._lay_out(packed, num_pictures)
        made = Layers()
        made.steps = wp.from_torch(torch.tensor(steps, dtype=torch.int32))
        made.weights = wp.from_torch(self.weights)
        made.num_convolutions = sum(layer.is_convolution for layer in packed)
        made.picture_size = packed[made.num_convolutions].num_inputs
        made.logits_at, made.num_outs = steps[-1][1], packed[-1].num_outs
        *places, self.num_outputs = outputs_at(packed)
        """Numbers that all layers make of a picture, and room between them."""
        made.outputs_at = wp.from_torch(torch.tensor(places, dtype=torch.int32))
        self.layers = made
        """For kernels."""
        self.num_actions = len(packed[-1].layer.weight)

    @classmethod
    def find(cls, network: nn.Module, num_pictures: int) -> Self | None:
        """The network, if it is of such layers and on the CPU."""
        packed = packed_layers(network)
        return None if packed is None else cls(packed, num_pictures)

    def update(self) -> None:
        """Takes over what the network has learned."""
        self._order.pack(self.weights)

    def _lay_out(
        self, packed: Sequence[PackedLayer], num_pictures: int
    ) -> tuple[list[list[int]], int]:
        """Steps of the layers, and the numbers that the room to work must hold."""
        steps, given_at, room = [], 0, 0
        for i, (layer, weights_at) in enumerate(zip(packed, self._order.weights_at, strict=False)):
            is_last = i == len(packed) - 1
            steps.append([given_at, room, weights_at, *layer.geometry, int(not is_last)])
            is_alone = not is_last and packed[i + 1].is_convolution
            given_at = room
            room += layer.num_made * (1 if is_alone else num_pictures)
        return steps, room
