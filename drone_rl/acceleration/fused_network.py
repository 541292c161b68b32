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
    OutputOffsets,
    PackedLayer,
    as_geometries,
    as_indices,
    odd_lines,
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
Wrt = Literal["weights", "pixels"]
"""What gradients are computed with respect to."""


class ActivationCache:
    """Activations of all layers, kept by a fused collector for the learner's forward pass.

    A handle identifies the activations of one observation. The collector passes it to the network
    as an entry of the batch. Handles are valid until the collector's next batch. `find` compares
    some pixels of each observation, so that changed observations are evaluated again. Code that
    changes only a few pixels must remove the entry.
    """

    def __init__(self, num_rows: int, num_activations: int) -> None:
        """Allocate memory for one batch of observations with `num_activations` each."""
        self.outputs = torch.empty(num_rows, num_activations)
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

        `rows`, (k,), index `outputs`; `weights` are the packed weights that gave them.
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
        """Return the rows of the activations with these handles (k,), or None if one is invalid.

        Handles are invalid once the packed weights or sampled pixels of the observations, (k, *),
        have changed.
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
    """Compute a network's logits and gradients in fused kernels, as torch does up to rounding.

    With a small network, torch spends a third of its time between matrix products. The fused kernel
    passes blocks of observations through all layers, so that the activations stay in cache.
    """

    def __init__(
        self,
        network: PolicyNetwork,
        num_threads: int = 1,
        *,
        wrt: Wrt = "weights",
        cache: ActivationCache | None = None,
    ) -> None:
        super().__init__()
        self.network, self.in_shape, self.actions = network, network.in_shape, network.actions
        self._num_threads, self._cache = num_threads, cache
        self._differentiates: Wrt = wrt
        self.in_keys = ("pixels",) if cache is None else ("pixels", ACTIVATIONS)
        self._engine: _Engine | None = None
        load_kernels(gradients_kernel)

    @classmethod
    def try_create(
        cls,
        network: nn.Module,
        num_threads: int = 1,
        *,
        wrt: Wrt = "weights",
        cache: Callable[[], ActivationCache | None] = lambda: None,
    ) -> Self | Reasons:
        """Return the fused network, or the reasons why the kernel does not support the network.

        Args:
            network: Network from pixels to logits.
            num_threads: Threads that share the observations; it affects the rounding of sums.
            wrt: Differentiate with respect to the weights, or to the pixels with fixed weights.
            cache: Called if the network is supported; see `FusedCollector.cache_activations`.
        """
        reasons = unsupported(network)
        if not reasons and wrt == "pixels" and not packed_layers(network)[0].has_transpose:
            reasons.append(f"the first layer's inputs are not a multiple of {WIDTH}")
        num_weights = sum(p.numel() for p in network.parameters())
        if num_weights > MAX_WEIGHTS:
            reasons.append(f"{num_weights} weights are more than {MAX_WEIGHTS}")
        if reasons or not isinstance(network, PolicyNetwork):
            return Reasons(reasons)
        return cls(network, num_threads, wrt=wrt, cache=cache())

    def forward(self, pixels: Tensor, activations: Tensor | None = None) -> Tensor:
        """Return the logits of pixels (*, C, H, W).

        `activations` are handles of the observations' activations in the cache. Shape: (*,).
        """
        if self._engine is None:
            layers = packed_layers(self.network)
            self._engine = _Engine(layers, self._num_threads, self._cache, self._differentiates)
        self.network.check(pixels)
        flat = pixels.reshape(-1, math.prod(self.in_shape)).contiguous()
        handles = None if activations is None else activations.reshape(-1)
        parameters = self._engine.parameters if self._differentiates == "weights" else ()
        logits = _Logits.apply(self._engine, flat, handles, *parameters)
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
        ctx: Any, engine: "_Engine", pixels: Tensor, handles: Tensor | None, *parameters: Tensor
    ) -> Tensor:
        ctx.engine, ctx.has_parameters = engine, bool(parameters)
        ctx.pixels = pixels.detach()  # Warp reads .grad, about which torch warns
        ctx.saved = engine.compute(ctx.pixels, handles)
        return engine.logits(ctx.saved)

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, grad_output: Tensor) -> tuple[Tensor | None, ...]:  # pyright: ignore[reportIncompatibleMethodOverride]
        if ctx.saved is None:
            raise RuntimeError("a second backward pass is impossible: activations were released")
        saved, ctx.saved = ctx.saved, None
        gradients = ctx.engine.gradients(ctx.pixels, saved, grad_output)
        return (None, None, None, *gradients) if ctx.has_parameters else (None, *gradients, None)


class _Engine:
    """Run both passes in threads, with packed layers and their buffers."""

    def __init__(
        self,
        layers: Sequence[PackedLayer],
        num_threads: int,
        cache: ActivationCache | None,
        wrt: Wrt,
    ) -> None:
        load_kernels(gradients_kernel).result()
        self._layers, self._cache, self._has_fixed_weights = layers, cache, wrt == "pixels"
        self._workers = WorkerPool(num_threads, num_threads)
        self._order = order = Order(layers)
        self._weights = torch.zeros(order.weight_offsets[-1])
        self._transposed = torch.zeros(order.transposed_offsets[-1])
        offsets = OutputOffsets.of(layers)
        self._logits_offset, self._size = offsets.outputs[-2:]
        params = self._params = PackedParams()
        params.geometries = as_geometries(
            {"weights_offset": at, **layer.geometry, "is_rectified": int(layer is not layers[-1])}
            for layer, at in zip(layers, order.weight_offsets, strict=False)
        )
        params.transposed = as_geometries(
            {"weights_offset": at, **_transposed(layer)}
            for layer, at in zip(layers, order.transposed_offsets, strict=False)
        )
        params.weights = wp.from_torch(self._weights)
        params.transposed_weights = wp.from_torch(self._transposed)
        params.output_offsets = as_indices(offsets.outputs)
        params.kept_offsets = as_indices(offsets.kept)
        params.num_convolutions = sum(layer.is_convolution for layer in layers)
        stride = odd_lines(self._logits_offset - offsets.kept[params.num_convolutions - 1])
        params.inputs_stride = stride
        self._gradients = torch.empty(self._workers.size, *self._weights.shape)
        numbers = (v.num_inputs * math.prod(v.output_shape) for v in layers if v.is_convolution)
        sizes = {"deltas": int(BLOCK) * self._size, "inputs": int(BLOCK) * stride}
        sizes["patches"] = max(numbers)
        self._workspaces = [Workspace() for _ in range(self._workers.size)]
        for workspace, gradients in zip(self._workspaces, self._gradients, strict=True):
            for name, size in sizes.items():
                setattr(workspace, name, wp.empty(size, dtype=float, device="cpu"))
            workspace.gradients = wp.from_torch(gradients[: 0 if self._has_fixed_weights else None])
        self._spare: Tensor | None = None
        """Buffer to reuse for outputs; allocating one takes longer than evaluating a layer."""
        order.pack(self._weights, self._transposed)

    @property
    def parameters(self) -> list[Tensor]:
        """Weight and bias of each layer."""
        return [parameter for layer in self._layers for parameter in layer.parameters]

    def compute(self, pixels: Tensor, handles: Tensor | None) -> _Activations:
        """Return the outputs of all layers, from the cache if they are there."""
        if not self._has_fixed_weights:
            self._order.pack(self._weights, self._transposed)
        if self._cache is not None and handles is not None:
            rows = self._cache.find(handles, self._weights, pixels)
            if rows is not None:
                outputs = self._cache.outputs.view(-1)
                return _Activations(outputs, rows, self._cache.generation)
        size, spare, self._spare = len(pixels) * self._size, self._spare, None
        outputs = torch.empty(size) if spare is None or len(spare) < size else spare
        batch: Any = Batch()
        batch.frames, batch.outputs = wp.from_torch(pixels), wp.from_torch(outputs)

        def run_span(member: int, first: int, last: int) -> None:
            del member
            inputs = [first, last, self._params, batch]
            wp.launch(gradients_kernel.forward, 1, inputs=inputs, device="cpu")

        self._workers.map_spans(0, len(pixels), run_span)
        return _Activations(outputs, torch.arange(len(pixels), dtype=torch.int32), None)

    def logits(self, saved: _Activations) -> Tensor:
        """Return the outputs of the last layer. Shape: (num_observations, num_actions)."""
        last = self._logits_offset + torch.arange(len(self._layers[-1].layer.weight))
        return saved.outputs.take(saved.rows[:, None].long() * self._size + last)

    def gradients(self, pixels: Tensor, saved: _Activations, grad_output: Tensor) -> list[Tensor]:
        """Return gradients of parameters or pixels.

        Invalidates `saved`: a later forward pass may overwrite its buffer.
        """
        if self._cache is not None and saved.generation not in (None, self._cache.generation):
            raise RuntimeError("a batch was collected between the forward and the backward pass")
        self._gradients.zero_()
        grad_pixels = torch.empty_like(pixels) if self._has_fixed_weights else torch.empty(0, 0)
        batch: Any = Batch()
        batch.frames, batch.outputs = wp.from_torch(pixels), wp.from_torch(saved.outputs)
        batch.rows, batch.grad_frames = wp.from_torch(saved.rows), wp.from_torch(grad_pixels)
        batch.grad_output = wp.from_torch(grad_output.contiguous())

        def run_span(member: int, first: int, last: int) -> None:
            inputs = [first, last, self._params, batch, self._workspaces[member]]
            wp.launch(gradients_kernel.backward, 1, inputs=inputs, device="cpu")

        self._workers.map_spans(0, len(pixels), run_span)
        if saved.generation is None:
            self._spare = saved.outputs
        return (
            [grad_pixels] if self._has_fixed_weights else self._order.unpack(self._gradients.sum(0))
        )


def _transposed(layer: PackedLayer) -> dict[str, int]:
    """Return the geometry that maps gradients with respect to outputs to those of the patches."""
    outs, size = layer.num_outs, layer.num_inputs
    patches = {"num_patches": math.prod(layer.output_shape), "patches_per_row": 1}
    kernel = {"row_stride": outs, "kernel_rows": 1, "kernel_row_length": outs}
    return {**patches, **kernel, "num_outs": size, "output_stride": size}
