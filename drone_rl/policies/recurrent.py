"""Policies that remember: an LSTM between the layers that see a frame and the logits."""

from collections.abc import Sequence
from contextvars import ContextVar
from typing import NamedTuple

import torch
from tensordict import TensorDict
from torch import Tensor, nn
from torchrl.modules import LSTMModule

from drone_rl.config.networks import Lstm
from drone_rl.config.registry import implements
from drone_rl.policies.networks import (
    ImageNetwork,
    SmallCNN,
    Trunk,
    check_shape,
    orthogonal,
    require_finite,
)

HIDDEN, CELL = "recurrent_state_h", "recurrent_state_c"
"""Entries of the state, by TorchRL's names; after a step they are under "next"."""
_FEATURES, _REMEMBERED = "features", "remembered"


WHOLE_EPISODES: ContextVar[bool | None] = ContextVar("whole_episodes", default=None)
"""Whether a network evaluates whole episodes in this thread; None for TorchRL's mode, which loss
modules set for all threads of the process."""


class _Lstm(LSTMModule):
    @property
    def recurrent_mode(self) -> bool:  # pyright: ignore[reportIncompatibleMethodOverride]
        """See `WHOLE_EPISODES`."""
        mode = WHOLE_EPISODES.get()
        return super().recurrent_mode if mode is None else mode


class Memory(NamedTuple):
    """State of the LSTM for N environments, zero when an episode starts."""

    hidden: Tensor  # (N, 1, size)
    cell: Tensor  # (N, 1, size)


@implements(Lstm)
class RecurrentNetwork(ImageNetwork):
    """`SmallCNN`'s layers up to the features, TorchRL's `LSTMModule`, and a linear layer.

    If `WHOLE_EPISODES`, or within TorchRL's `set_recurrent_mode(True)`, it evaluates whole
    episodes, one after the other, each from the state of its first step; else one step of each
    environment. The forget gates' biases are initially 1, so that the gradient of early frames
    doesn't vanish; other weights are orthogonal.
    """

    is_recurrent = True
    in_keys = ("pixels", "is_init", HIDDEN, CELL)
    out_keys = ("logits", ("next", HIDDEN), ("next", CELL))

    def __init__(
        self,
        in_shape: Sequence[int],
        num_actions: int,
        *,
        patch: int = Lstm().patch,
        channels: Sequence[int] = Lstm().channels,
        hidden: Sequence[int] = Lstm().hidden,
        memory: int = Lstm().memory,
        generator: torch.Generator | None = None,
    ) -> None:
        super().__init__()
        self.in_shape = tuple(in_shape)
        sizes = {"patch": patch, "channels": channels, "hidden": hidden}
        seeing = SmallCNN(in_shape, 1, **sizes, generator=generator)
        self.trunk = Trunk(seeing)
        self.lstm = _Lstm(
            input_size=seeing.layers.get_parameter("logits.weight").shape[1],
            hidden_size=memory,
            in_keys=[_FEATURES, HIDDEN, CELL],
            out_keys=[_REMEMBERED, ("next", HIDDEN), ("next", CELL)],
        )
        for name, weight in self.lstm.lstm.named_parameters():
            if name.startswith("weight"):
                nn.init.orthogonal_(weight, generator=generator)
            else:
                nn.init.zeros_(weight)
        with torch.no_grad():  # torch orders the gates: input, forget, cell, output
            self.lstm.lstm.get_parameter("bias_ih_l0")[memory : 2 * memory] = 1
        self.logits = nn.Linear(memory, num_actions)
        orthogonal(generator)(self.logits, True)

    @property
    def num_actions(self) -> int:
        """Number of outputs, see `Actions.num_outputs`."""
        return self.logits.out_features

    @torch.no_grad()
    def rescale(self, factor: Tensor, shift: Tensor) -> None:
        """See `ImageNetwork`; the last layer changes."""
        self.logits.weight.mul_(factor[:, None])
        self.logits.bias.mul_(factor).add_(shift)

    def start(self, num_envs: int) -> Memory:
        """Return the state of environments whose episodes start."""
        size = self.logits.in_features
        zeros = self.logits.weight.new_zeros(num_envs, 1, size)
        return Memory(zeros, zeros.clone())

    def step(self, pixels: Tensor, memory: Memory) -> tuple[Tensor, Memory]:
        """Take one step: frames (N, C, H, W) to outputs (N, num_actions), and the next state.

        As `forward` outside recurrent mode, without TensorDicts, which exporters do not support.
        """
        check_shape(pixels, self.in_shape)
        before = tuple(part.transpose(0, 1).contiguous() for part in memory)
        remembered, after = self.lstm.lstm(self.trunk(pixels)[:, None], before)
        logits = self.logits(remembered[:, 0])
        if not (torch.is_grad_enabled() or torch.compiler.is_compiling()):
            require_finite(logits, self.owner)
        return logits, Memory(*(part.transpose(0, 1) for part in after))

    def forward(  # pyright: ignore[reportIncompatibleMethodOverride] (a policy of images has none)
        self,
        pixels: Tensor,
        is_init: Tensor | None = None,
        hidden: Tensor | None = None,
        cell: Tensor | None = None,
    ) -> Tensor | tuple[Tensor, Tensor, Tensor]:
        """Return the outputs and the states after each step.

        Given frames alone, return the outputs if each is the first frame of an episode.

        Args:
            pixels: Frames. Shape: (N, C, H, W).
            is_init: Whether an episode starts; bool. Shape: (N, 1).
            hidden: States before each step, of which only an episode's first is read in recurrent
                mode. Shape: (N, 1, size).
            cell: As `hidden`.

        Returns:
            Outputs (N, num_actions) and the two parts of the state, (N, 1, size) each; in recurrent
            mode the states are zero but for the last step of each episode.

        Raises:
            InputError: Their shape differs; or, without gradients, an output is not finite.
        """
        if is_init is None or hidden is None or cell is None:
            return self.step(pixels, self.start(len(pixels)))[0]
        check_shape(pixels, self.in_shape)
        entries = {_FEATURES: self.trunk(pixels), "is_init": is_init, HIDDEN: hidden, CELL: cell}
        after = self.lstm(TensorDict(entries, [len(pixels)], device=pixels.device))
        logits = self.logits(after[_REMEMBERED])
        if not torch.is_grad_enabled():
            require_finite(logits, self.owner)
        return logits, after["next", HIDDEN], after["next", CELL]
