"""Fused forward and backward pass of a small network, and the activations that it reuses."""

import math
from collections.abc import Callable, Sequence
from typing import Any, Literal, NamedTuple, Self

import torch
import warp as wp
from torch import Tensor, nn
from torch.autograd.function import once_differentiable

from drone_rl.acceleration import gradients_kernel
from drone_rl.acceleration.gradients_kernel import BLOCK, Batch, PackedParams, Workspace
from drone_rl.acceleration.layers_kernel import WIDTH
from drone_rl.acceleration.packed_layers import (
    Order,
    PackedLayer,
    as_products,
    odd_lines,
    outputs_at,
    packed_layers,
    unsupported,
)
from drone_rl.envs.direct_renderer import Reasons
from drone_rl.policies.networks import ImageNetwork, PolicyNetwork
from drone_rl.sim.rendering.devices import WorkerPool, load_kernels

MAX_WEIGHTS = 2**20
"""Larger networks do not fit into a core's cache, and torch is as fast."""
ACTIVATIONS = "activations"
"""Entry of a batch: the handle of each step's activations in an `ActivationCache`."""
GradientsOf = Literal["weights", "pixels"]


class ActivationCache:
    """Activations of all layers, kept by a fused collector for the learner's forward pass.

    A handle identifies the activations of one observation. The collector passes it to the network
    as an entry of the batch. Handles are valid until the collector's next batch. `find` compares
    some pixels of each observation, so that changed observations are evaluated again. Code that
    changes only a few pixels must remove the entry.
    """

    def __init__(self, num_rows: int, num_outputs: int) -> None:
        """Allocate memory for one batch of observations with `num_outputs` activations each."""
        self.outputs = torch.empty(num_rows, num_outputs)
        """Written by the collector between `clear` and `add`."""
        self.generation = 0
        """Number of calls of `clear`."""
        self._weights = torch.empty(0)
        self._samples: Tensor | None = None

    def clear(self) -> None:
        """Invalidate all handles, before the activations are overwritten."""
        self.generation += 1

    def add(self, rows: Tensor, weights: Tensor, observations: Tensor) -> Tensor:
        """Return the handles of activations, (k,); all are -1 if the memory does not suffice.

        `rows`, (k,), index `outputs`; `weights` are the packed weights of the activations.
        """
        self._weights = weights
        if int(rows.max()) >= len(self.outputs):
            return torch.full_like(rows, -1)
        sampled = _sample_pixels(observations)
        if self._samples is None:
            self._samples = sampled.new_empty(len(self.outputs), sampled.shape[1])
        self._samples[rows] = sampled
        return rows + self.generation * len(self.outputs)

    def find(self, handles: Tensor, weights: Tensor, observations: Tensor) -> Tensor | None:
        """Return the rows of activations by their handles (k,), or None unless all are valid.

        Handles are invalid if the packed weights or the observations, (k, *), have changed.
        """
        rows = handles - self.generation * len(self.outputs)
        is_valid = (rows >= 0) & (rows < len(self.outputs))
        if not (bool(is_valid.all()) and torch.equal(weights, self._weights)):
            return None
        known = self._samples
        if known is None or not torch.equal(known[rows], _sample_pixels(observations)):
            return None
        return rows.int()


def _sample_pixels(observations: Tensor) -> Tensor:
    """Return about 16 pixels of each observation. Shape: (k, up to 31)."""
    flat = observations.flatten(1)
    return flat[:, :: max(1, flat.shape[1] // 16)]


class FusedNetwork(ImageNetwork):
    """Compute the same logits and gradients as a network, faster than torch.

    With a small network, torch spends a third of its time between matrix products. The fused kernel
    passes blocks of observations through all layers, so that the activations stay in cache.
    """

    def __init__(
        self,
        network: PolicyNetwork,
        num_threads: int = 1,
        *,
        of: GradientsOf = "weights",
        cache: ActivationCache | None = None,
    ) -> None:
        super().__init__()
        self.network, self.in_shape, self.actions = network, network.in_shape, network.actions
        self._num_threads, self._cache = num_threads, cache
        self._of: GradientsOf = of
        self.in_keys = ("pixels",) if cache is None else ("pixels", ACTIVATIONS)
        self._work: _Work | None = None
        load_kernels(gradients_kernel)

    @classmethod
    def try_create(
        cls,
        network: nn.Module,
        num_threads: int = 1,
        *,
        of: GradientsOf = "weights",
        cache: Callable[[], ActivationCache | None] = lambda: None,
    ) -> Self | Reasons:
        """Return the fused network, or the reasons why the kernel does not support the network.

        Args:
            network: Network from pixels to logits.
            num_threads: Threads that share the observations; it affects the rounding of sums.
            of: Differentiate by the weights or the pixels. For pixels, the weights are read once.
            cache: Called if the network is supported; see `FusedCollector.cache_activations`.
        """
        reasons = unsupported(network)
        if not reasons and of == "pixels" and not packed_layers(network)[0].has_transpose:
            reasons.append(f"the first layer's inputs are not a multiple of {WIDTH}")
        num_weights = sum(p.numel() for p in network.parameters())
        if num_weights > MAX_WEIGHTS:
            reasons.append(f"{num_weights} weights are more than {MAX_WEIGHTS}")
        if reasons or not isinstance(network, PolicyNetwork):
            return Reasons(reasons)
        return cls(network, num_threads, of=of, cache=cache())

    def forward(self, pixels: Tensor, activations: Tensor | None = None) -> Tensor:
        """Return the logits of pixels (*, C, H, W).

        `activations` are handles of the observations' activations in the cache. Shape: (*,).
        """
        if self._work is None:
            layers = packed_layers(self.network)
            self._work = _Work(layers, self._num_threads, self._cache, self._of)
        self.network.check(pixels)
        flat = pixels.reshape(-1, math.prod(self.in_shape))
        handles = None if activations is None else activations.reshape(-1)
        learning = self._work.parameters if self._of == "weights" else ()
        logits = _Logits.apply(self._work, flat, handles, *learning)
        return logits.reshape(*pixels.shape[:-3], -1)


class _Activations(NamedTuple):
    outputs: Tensor
    """Outputs of all layers, flat, observation by observation; the end may be unused."""
    rows: Tensor
    """Row of each observation."""
    generation: int | None
    """Generation of the `ActivationCache`; None if the activations are not cached."""


class _Logits(torch.autograd.Function):
    @staticmethod
    def forward(
        ctx: Any, work: "_Work", pixels: Tensor, handles: Tensor | None, *parameters: Tensor
    ) -> Tensor:
        ctx.work, ctx.is_learning = work, bool(parameters)
        ctx.pixels = pixels.detach()  # Warp reads .grad, about which torch warns
        ctx.made = work.compute(ctx.pixels, handles)
        return work.logits(ctx.made)

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, grad_output: Tensor) -> tuple[Tensor | None, ...]:  # pyright: ignore[reportIncompatibleMethodOverride]
        if ctx.made is None:
            raise RuntimeError("a second backward pass is impossible: activations were released")
        made, ctx.made = ctx.made, None
        gradients = ctx.work.gradients(ctx.pixels, made, grad_output)
        return (None, None, None, *gradients) if ctx.is_learning else (None, *gradients, None)


class _Work:
    """Packed layers and the buffers of both passes."""

    def __init__(
        self,
        layers: Sequence[PackedLayer],
        num_threads: int,
        cache: ActivationCache | None,
        of: GradientsOf,
    ) -> None:
        load_kernels(gradients_kernel).result()
        self._layers, self._cache, self._is_fixed = layers, cache, of == "pixels"
        self._workers = WorkerPool(num_threads, num_threads)
        self._order = order = Order(layers)
        self._weights = torch.zeros(order.weights_at[-1])
        self._back = torch.zeros(order.back_at[-1])
        made_at = outputs_at(layers)
        self._logits_at, self._size = made_at[-2:]
        params = self._params = PackedParams()
        params.products = as_products(
            [0, at, 0, *layer.geometry, int(layer is not layers[-1])]
            for layer, at in zip(layers, order.weights_at, strict=False)
        )
        params.transposed = as_products(
            _transposed(layer, at) for layer, at in zip(layers, order.back_at, strict=False)
        )
        params.weights, params.back = wp.from_torch(self._weights), wp.from_torch(self._back)
        params.made_at = wp.from_torch(torch.tensor(made_at, dtype=torch.int32))
        params.num_convolutions = sum(layer.is_convolution for layer in layers)
        stride = odd_lines(self._logits_at - made_at[params.num_convolutions - 1])
        params.inputs_stride = stride
        self._gradients = torch.empty(self._workers.size, *self._weights.shape)
        most = max(v.num_inputs * v.geometry[0] for v in layers if v.is_convolution)
        sizes = {"deltas": int(BLOCK) * self._size, "inputs": int(BLOCK) * stride, "patches": most}
        self._workspaces = [Workspace() for _ in range(self._workers.size)]
        for workspace, gradients in zip(self._workspaces, self._gradients, strict=True):
            for name, size in sizes.items():
                setattr(workspace, name, wp.empty(size, dtype=float, device="cpu"))
            workspace.gradients = wp.from_torch(gradients[: 0 if self._is_fixed else None])
        self._spare: Tensor | None = None
        """Buffer to reuse for outputs; allocating one takes longer than evaluating a layer."""
        order.pack(self._weights, self._back)

    @property
    def parameters(self) -> list[Tensor]:
        """Weight and bias of each layer."""
        return [parameter for layer in self._layers for parameter in layer.parameters]

    def compute(self, pixels: Tensor, handles: Tensor | None) -> _Activations:
        """Return the outputs of all layers, from the cache if they are there."""
        if not self._is_fixed:
            self._order.pack(self._weights, self._back)
        if self._cache is not None and handles is not None:
            rows = self._cache.find(handles, self._weights, pixels)
            if rows is not None:
                outputs = self._cache.outputs.view(-1)
                return _Activations(outputs, rows, self._cache.generation)
        size, spare, self._spare = len(pixels) * self._size, self._spare, None
        made = torch.empty(size) if spare is None or len(spare) < size else spare
        batch: Any = Batch()
        batch.frames, batch.made = wp.from_torch(pixels), wp.from_torch(made)

        def work(member: int, first: int, last: int) -> None:
            del member
            inputs = [first, last, self._params, batch]
            wp.launch(gradients_kernel.forward, 1, inputs=inputs, device="cpu")

        self._workers.map_spans(0, len(pixels), work)
        return _Activations(made, torch.arange(len(pixels), dtype=torch.int32), None)

    def logits(self, made: _Activations) -> Tensor:
        """Return the outputs of the last layer. Shape: (num_observations, num_actions)."""
        last = self._logits_at + torch.arange(len(self._layers[-1].layer.weight))
        return made.outputs.take(made.rows[:, None].long() * self._size + last)

    def gradients(self, pixels: Tensor, made: _Activations, grad_output: Tensor) -> list[Tensor]:
        """Return the gradient of each parameter, or of the pixels; `made` may be overwritten."""
        if self._cache is not None and made.generation not in (None, self._cache.generation):
            raise RuntimeError("a batch was collected between the forward and the backward pass")
        self._gradients.zero_()
        grad_pixels = torch.empty_like(pixels) if self._is_fixed else torch.empty(0, 0)
        batch: Any = Batch()
        batch.frames, batch.made = wp.from_torch(pixels), wp.from_torch(made.outputs)
        batch.rows, batch.grad_frames = wp.from_torch(made.rows), wp.from_torch(grad_pixels)
        batch.grad_output = wp.from_torch(grad_output.contiguous())

        def work(member: int, first: int, last: int) -> None:
            inputs = [first, last, self._params, batch, self._workspaces[member]]
            wp.launch(gradients_kernel.backward, 1, inputs=inputs, device="cpu")

        self._workers.map_spans(0, len(pixels), work)
        if made.generation is None:
            self._spare = made.outputs
        return [grad_pixels] if self._is_fixed else self._order.unpack(self._gradients.sum(0))


def _transposed(layer: PackedLayer, weights_at: int) -> list[int]:
    """Return the fields of the product that maps gradients of outputs to those of patches."""
    outs, size = layer.num_outs, layer.num_inputs
    return [0, weights_at, 0, layer.geometry[0], 1, outs, 0, 1, outs, 0, size, size, 0]
