# pyright: reportAttributeAccessIssue=false
# pyright: reportGeneralTypeIssues=false
# pyright: reportIncompatibleMethodOverride=false
# (Warp's structures are untyped, and so is what autograd calls.)
"""A network whose gradients a kernel works out, where it knows the layers."""

import math
from collections.abc import Sequence
from typing import Any, Literal, NamedTuple, Self

import torch
import warp as wp
from torch import Tensor, nn
from torch.autograd.function import once_differentiable

from drone_rl.policies import gradients_kernel
from drone_rl.policies.cnn import PolicyNetwork
from drone_rl.policies.gradients_kernel import BLOCK, Lesson
from drone_rl.policies.known_outputs import KnownOutputs
from drone_rl.policies.network import PictureNetwork
from drone_rl.policies.packed_layer import Order, PackedLayer, odd_lines, outputs_at, packed_layers
from drone_rl.sim.rendering.devices import WorkerPool, load_kernels

MOST_WEIGHTS = 2**20
"""Of a network; more of them don't stay near a core, and torch is as fast."""
Of = Literal["weights", "pictures"]
"""What has gradients."""


class LearningNetwork(PictureNetwork):
    """Gives what a network gives, and its weights the gradients, in less time than torch does.

    On a small network torch spends a third of its time between products; here each layer's product
    is made where its numbers lie, in blocks of pictures that stay near.
    """

    def __init__(self, network: PolicyNetwork, num_threads: int = 1, *, of: Of = "weights") -> None:
        """Wraps a network; `find` tells whether that can be done.

        Args:
            network: From pictures to logits.
            num_threads: That share the pictures; sums over these depend on how many there are.
            of: What has gradients: the weights, or the pictures. For those of pictures the weights
                stay what they are at first.
        """
        super().__init__()
        self.network, self.in_shape, self.actions = network, network.in_shape, network.actions
        self._num_threads, self._of = num_threads, of
        self.known: KnownOutputs | None = None
        """Outputs that somebody else makes by the same network; looked for at each call."""
        self._work: _Work | None = None
        load_kernels(gradients_kernel)

    @classmethod
    def find(cls, network: nn.Module, num_threads: int = 1, *, of: Of = "weights") -> Self | None:
        """The same, if the network is of such layers, small, and on the CPU."""
        layers = packed_layers(network)
        if layers is None or (of == "pictures" and not layers[0].has_way_back):
            return None
        if sum(p.numel() for p in network.parameters()) > MOST_WEIGHTS:
            return None
        assert isinstance(network, PolicyNetwork)
        return cls(network, num_threads, of=of)

    def forward(self, pixels: Tensor) -> Tensor:
        """See `PictureNetwork`.

        Raises:
            InputError: The pictures are of another shape than the network was built for.
        """
        if self._work is None:
            layers = packed_layers(self.network) or []
            is_fixed = self._of == "pictures"
            self._work = _Work(layers, self._num_threads, self.known, is_fixed=is_fixed)
        self.network.check(pixels)
        flat = pixels.reshape(-1, math.prod(self.in_shape))
        learning = self._work.parameters if self._of == "weights" else ()
        logits = _Logits.apply(self._work, flat, *learning)
        return logits.reshape(*pixels.shape[:-3], -1)


class _Made(NamedTuple):
    """Outputs of all layers."""

    outputs: Tensor
    """A row a picture, one after the other; there may be room behind. Flat."""
    rows: Tensor
    """Which of them each picture has."""
    times: int | None
    """Of `KnownOutputs`, if they are such."""


class _Logits(torch.autograd.Function):
    """The way there and back."""

    @staticmethod
    def forward(ctx: Any, work: "_Work", pictures: Tensor, *parameters: Tensor) -> Tensor:
        ctx.work, ctx.of = work, "weights" if parameters else "pictures"
        ctx.pictures = pictures.detach()  # Warp asks arrays for gradients, which torch warns of
        ctx.made = work.answer(ctx.pictures)
        return work.logits(ctx.made)

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, slopes: Tensor) -> tuple[Tensor | None, ...]:
        if ctx.made is None:
            raise RuntimeError("the way back was gone once; its numbers were given away")
        made, ctx.made = ctx.made, None
        if ctx.of == "pictures":
            return None, ctx.work.look_back(ctx.pictures, made, slopes)
        return None, None, *ctx.work.learn(ctx.pictures, made, slopes)


class _Work:
    """Packed layers, and room to work in."""

    def __init__(
        self,
        layers: Sequence[PackedLayer],
        num_threads: int,
        known: KnownOutputs | None,
        *,
        is_fixed: bool,
    ) -> None:
        load_kernels(gradients_kernel).result()
        self._layers, self._known = layers, known
        self._workers = WorkerPool(num_threads, num_threads)
        self._order = order = Order(layers)
        self._weights = torch.zeros(order.weights_at[-1])
        self._back = torch.zeros(order.back_at[-1])
        made_at = outputs_at(layers)
        self._logits_at, self._size = made_at[-2:]
        lesson = Lesson()
        lesson.geometry = _ints([layer.geometry for layer in layers])
        lesson.weights_at, lesson.back_at = _ints(order.weights_at), _ints(order.back_at)
        lesson.weights, lesson.back = wp.from_torch(self._weights), wp.from_torch(self._back)
        lesson.made_at = _ints(made_at)
        lesson.num_convolutions = sum(layer.is_convolution for layer in layers)
        lesson.near = odd_lines(self._logits_at - made_at[lesson.num_convolutions - 1])
        self._lesson = lesson
        self._rooms = torch.empty(self._workers.size, int(BLOCK) * self._size)
        self._sides = torch.empty(self._workers.size, int(BLOCK) * lesson.near)
        most = max(v.num_inputs * v.geometry[0] for v in layers if v.is_convolution)
        self._patches = torch.empty(self._workers.size, most)
        self._spare: Tensor | None = None
        """Of outputs that nobody needs any more; new memory takes longer than a layer."""
        self._gradients = torch.empty(self._workers.size, *self._weights.shape)
        self._is_fixed = is_fixed
        order.pack(self._weights, self._back)

    @property
    def parameters(self) -> list[Tensor]:
        """Weight and bias of each layer."""
        return [parameter for layer in self._layers for parameter in layer.parameters]

    def answer(self, pictures: Tensor) -> _Made:
        """Outputs of all layers."""
        if not self._is_fixed:
            self._order.pack(self._weights, self._back)
        if self._known is not None:
            rows = self._known.find(pictures, self._weights)
            if rows is not None:
                return _Made(self._known.outputs.view(-1), rows, self._known.times)
        size, spare, self._spare = len(pictures) * self._size, self._spare, None
        made = torch.empty(size) if spare is None or len(spare) < size else spare
        given = [self._lesson, wp.from_torch(pictures), wp.from_torch(made)]

        def work(member: int, first: int, last: int) -> None:
            del member
            inputs = [first, last, *given]
            wp.launch(gradients_kernel.answer, 1, inputs=inputs, device="cpu")

        self._workers.map_spans(0, len(pictures), work)
        return _Made(made, torch.arange(len(pictures), dtype=torch.int32), None)

    def logits(self, made: _Made) -> Tensor:
        """Those of the last layer. Shape: (num_pictures, num_actions)."""
        last = self._logits_at + torch.arange(len(self._layers[-1].layer.weight))
        return made.outputs.take(made.rows[:, None].long() * self._size + last)

    def learn(self, pictures: Tensor, made: _Made, slopes: Tensor) -> list[Tensor]:
        """Gradients of the parameters by those of the logits; takes `made` for the next answer."""
        self._gradients.zero_()
        self._go_back(pictures, made, slopes, self._gradients, torch.empty(0, 0))
        return self._order.unpack(self._gradients.sum(0))

    def look_back(self, pictures: Tensor, made: _Made, slopes: Tensor) -> Tensor:
        """Gradient of the pictures by those of the logits; takes `made` for the next answer."""
        seen = torch.empty_like(pictures)
        self._go_back(pictures, made, slopes, torch.empty(0, 0), seen)
        return seen

    def _go_back(
        self, pictures: Tensor, made: _Made, slopes: Tensor, gradients: Tensor, seen: Tensor
    ) -> None:
        if self._known is not None and made.times not in (None, self._known.times):
            raise RuntimeError("pictures were flown through between the way there and the way back")
        rooms = (self._rooms, self._sides, self._patches)
        arrays = (pictures, made.outputs, made.rows, slopes.contiguous(), *rooms, gradients, seen)
        given = [self._lesson, *(wp.from_torch(array) for array in arrays)]

        def work(member: int, first: int, last: int) -> None:
            inputs = [first, last, member, *given]
            wp.launch(gradients_kernel.learn, 1, inputs=inputs, device="cpu")

        self._workers.map_spans(0, len(pictures), work)
        if made.times is None:
            self._spare = made.outputs


def _ints(values: Any) -> wp.array:
    return wp.from_torch(torch.tensor(values, dtype=torch.int32))
