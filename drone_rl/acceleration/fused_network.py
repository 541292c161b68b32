"""Fused forward and backward pass of a small network."""

import math
from collections.abc import Sequence
from typing import Any, Literal, NamedTuple, Self

import torch
import warp as wp
from torch import Tensor, nn
from torch.autograd.function import once_differentiable

from drone_rl.acceleration import gradients_kernel
from drone_rl.acceleration.activations import ActivationRecorder, Recording
from drone_rl.acceleration.gradients_kernel import BLOCK, FrameBatch, PackedParams, Workspace
from drone_rl.acceleration.layers_kernel import WIDTH
from drone_rl.acceleration.packed_layers import (
    Order,
    OutputOffsets,
    PackedLayer,
    Reasons,
    as_geometries,
    as_indices,
    odd_lines,
    packed_layers,
    unsupported,
)
from drone_rl.policies.networks import ImageNetwork, PolicyNetwork
from drone_rl.sim.rendering.devices import WorkerPool, load_kernels

MAX_WEIGHTS = 2**20
"""Larger networks do not fit into a core's cache, and torch is as fast."""
Wrt = Literal["weights", "pixels"]
"""What gradients are computed with respect to."""


class FusedNetwork(ImageNetwork):
    """Compute a network's logits and gradients in fused kernels, as torch does up to rounding.

    With a small network, torch spends most of its time between matrix products. The fused kernel
    passes blocks of observations through all layers, so that the activations stay in cache.
    """

    def __init__(
        self,
        network: PolicyNetwork,
        num_threads: int = 1,
        *,
        wrt: Wrt = "weights",
        activations: ActivationRecorder | None = None,
    ) -> None:
        super().__init__()
        self.network, self.in_shape, self.actions = network, network.in_shape, network.actions
        self._num_threads, self._activations = num_threads, activations
        self._differentiates: Wrt = wrt
        self._engine: _Engine | None = None
        load_kernels(gradients_kernel)
        if activations is not None:
            activations.start()

    @classmethod
    def try_create(
        cls,
        network: nn.Module,
        num_threads: int = 1,
        *,
        wrt: Wrt = "weights",
        activations: ActivationRecorder | None = None,
    ) -> Self | Reasons:
        """Return the fused network, or the reasons why the kernel does not support the network.

        Args:
            network: Network from pixels to logits.
            num_threads: Threads that share the observations; it affects the rounding of sums.
            wrt: Differentiate with respect to the weights, or to the pixels with fixed weights.
            activations: Those of a `FusedCollector`, which batches from it need not compute again.
        """
        reasons = unsupported(network)
        if not reasons and wrt == "pixels" and not packed_layers(network)[0].has_transpose:
            reasons.append(f"the first layer's inputs are not a multiple of {WIDTH}")
        num_weights = sum(p.numel() for p in network.parameters())
        if num_weights > MAX_WEIGHTS:
            reasons.append(f"{num_weights} weights are more than {MAX_WEIGHTS}")
        if reasons or not isinstance(network, PolicyNetwork):
            return Reasons(reasons)
        return cls(network, num_threads, wrt=wrt, activations=activations)

    def forward(self, pixels: Tensor) -> Tensor:
        """Return the logits of pixels (*, C, H, W)."""
        if self._engine is None:
            layers = packed_layers(self.network)
            self._engine = _Engine(
                layers, self._num_threads, self._differentiates, self._activations
            )
        self.network.check(pixels)
        flat = pixels.reshape(-1, math.prod(self.in_shape)).contiguous()
        parameters = self._engine.parameters if self._differentiates == "weights" else ()
        return _Logits.apply(self._engine, flat, *parameters).reshape(*pixels.shape[:-3], -1)


class _Outputs(NamedTuple):
    """Outputs of all layers for some observations."""

    values: Tensor
    """Flat, row after row; the end may be unused."""
    rows: Tensor
    """Row of each observation."""
    recording: Recording | None = None
    """Where they come from, unless they were computed."""


class _Logits(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, engine: "_Engine", pixels: Tensor, *parameters: Tensor) -> Tensor:
        ctx.engine, ctx.has_parameters = engine, bool(parameters)
        ctx.pixels = pixels.detach()  # Warp reads .grad, about which torch warns
        ctx.outputs = engine.compute(ctx.pixels)
        return engine.logits(ctx.outputs)

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, grad_output: Tensor) -> tuple[Tensor | None, ...]:  # pyright: ignore[reportIncompatibleMethodOverride]
        if ctx.outputs is None:
            raise RuntimeError("a second backward pass is impossible: activations were released")
        outputs, ctx.outputs = ctx.outputs, None
        gradients = ctx.engine.gradients(ctx.pixels, outputs, grad_output)
        return (None, None, *gradients) if ctx.has_parameters else (None, *gradients)


class _Engine:
    """Run both passes in threads, with packed layers and their buffers."""

    def __init__(
        self,
        layers: Sequence[PackedLayer],
        num_threads: int,
        wrt: Wrt,
        activations: ActivationRecorder | None,
    ) -> None:
        load_kernels(gradients_kernel).result()
        self._layers, self._activations = layers, activations
        self._has_fixed_weights = wrt == "pixels"
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

    def compute(self, pixels: Tensor) -> _Outputs:
        """Return the outputs of all layers, those that were recorded if there are any."""
        if not self._has_fixed_weights:
            self._order.pack(self._weights, self._transposed)
        recorder = self._activations
        rows = None if recorder is None else recorder.find(pixels, self._weights)
        if recorder is not None and rows is not None:
            return _Outputs(recorder.outputs.view(-1), rows, recorder.recording)
        size, spare, self._spare = len(pixels) * self._size, self._spare, None
        outputs = torch.empty(size) if spare is None or len(spare) < size else spare
        batch: Any = FrameBatch()
        batch.frames, batch.outputs = wp.from_torch(pixels), wp.from_torch(outputs)

        def run_span(member: int, first: int, last: int) -> None:
            del member
            inputs = [first, last, self._params, batch]
            wp.launch(gradients_kernel.forward, 1, inputs=inputs, device="cpu")

        self._workers.map_spans(0, len(pixels), run_span)
        return _Outputs(outputs, torch.arange(len(pixels), dtype=torch.int32))

    def logits(self, outputs: _Outputs) -> Tensor:
        """Return the outputs of the last layer. Shape: (num_observations, num_actions)."""
        last = self._logits_offset + torch.arange(len(self._layers[-1].layer.weight))
        return outputs.values.take(outputs.rows[:, None].long() * self._size + last)

    def gradients(self, pixels: Tensor, outputs: _Outputs, grad_output: Tensor) -> list[Tensor]:
        """Return gradients of parameters or pixels; the next call of `compute` reuses `outputs`."""
        values, rows, recording = outputs
        recorder = self._activations
        if recording and recorder and recorder.recording is not recording:
            raise RuntimeError("a batch was collected between the forward and the backward pass")
        self._gradients.zero_()
        grad_pixels = torch.empty_like(pixels) if self._has_fixed_weights else torch.empty(0, 0)
        batch: Any = FrameBatch()
        batch.frames, batch.outputs = wp.from_torch(pixels), wp.from_torch(values)
        batch.rows, batch.grad_frames = wp.from_torch(rows), wp.from_torch(grad_pixels)
        batch.grad_output = wp.from_torch(grad_output.contiguous())

        def run_span(member: int, first: int, last: int) -> None:
            inputs = [first, last, self._params, batch, self._workspaces[member]]
            wp.launch(gradients_kernel.backward, 1, inputs=inputs, device="cpu")

        self._workers.map_spans(0, len(pixels), run_span)
        if recording is None:
            self._spare = values
        return (
            [grad_pixels] if self._has_fixed_weights else self._order.unpack(self._gradients.sum(0))
        )


def _transposed(layer: PackedLayer) -> dict[str, int]:
    """Return the geometry that maps gradients with respect to outputs to those of the patches."""
    outs, size = layer.num_outs, layer.num_inputs
    patches = {"num_patches": math.prod(layer.output_shape), "patches_per_row": 1}
    kernel = {"row_stride": outs, "kernel_rows": 1, "kernel_row_length": outs}
    return {**patches, **kernel, "num_outs": size, "output_stride": size}
