"""A fully connected policy network, as in the original study's comparison."""

import math
from collections import OrderedDict
from collections.abc import Sequence

import torch
from torch import nn

from drone_rl.config.networks import Mlp
from drone_rl.config.registry import implements
from drone_rl.policies.cnn import PolicyNetwork, orthogonal


@implements(Mlp)
class MLP(PolicyNetwork):
    """Linear layers on the flattened picture."""

    def __init__(
        self,
        in_shape: Sequence[int],
        num_actions: int,
        *,
        hidden: Sequence[int] = Mlp.hidden,
        generator: torch.Generator | None = None,
    ) -> None:
        """Builds and initialises it: orthogonal, the logits near zero (a uniform first policy).

        Args:
            in_shape: Shape (C, H, W) of one picture.
            num_actions: Number of logits.
            hidden: Widths of the linear layers but the last.
            generator: Source of the initial weights.
        """
        layers: OrderedDict[str, nn.Module] = OrderedDict(flatten=nn.Flatten())
        width = math.prod(in_shape)
        for i, size in enumerate(hidden, start=1):
            layers[f"fc{i}"] = nn.Linear(width, size)
            layers[f"fc_relu{i}"] = nn.ReLU()
            width = size
        layers["logits"] = nn.Linear(width, num_actions)
        super().__init__(in_shape, layers, orthogonal(generator))
