"""Fused forward and backward pass of a small network."""

import math
from typing import Any, Literal, NamedTuple, Self, TypeVar

import torch
import warp as wp
from torch import Tensor, nn
from torch.autograd.function import once_differentiable

from drone_rl.acceleration import gradients_kernel
from drone_rl.acceleration.gradients_kernel import BLOCK, FrameBatch, PackedParams, Workspace
from drone_rl.acceleration.layers_kernel import WIDTH
from drone_rl.acceleration.packed_layers import (
    PackedNetwork,
    Reasons,
    odd_lines,
    packed_layers,
    starts,
    unsupported,
)
from drone_rl.policies.networks import ImageNetwork, InputsNetwork, PolicyNetwork
from drone_rl.sim.rendering.devices import WorkerPool, load_kernels

MAX_WEIGHTS = 2**20
"""Larger networks do not fit into a core's cache, and torch is as fast."""
N = TypeVar("N", bound=nn.Module)
Wrt = Literal["weights", "pixels"]
"""What gradients are computed with respect to."""


class Recording(NamedTuple):
    """Outputs of all layers for the observations of one batch."""

    pixels: Tensor
    """Observations, by identity: images, then vectors. Shape: (k, *)."""
    version: int
    """Counter of the changes of `pixels` in place."""
    weights: Tensor
    """Packed weights that gave the outputs."""
    rows: Tensor
    """Row of each observation among the outputs."""


class ActivationRecorder:
    """Outputs of all layers that a collector's kernel hands to the learner, which needs them, too.

    A fused collector writes them once a learner asks. The learner finds them by the memory of the
    observations: it passes the batch's pixels, or a slice of them. A copy is evaluated again, as
    are pixels that were changed in place (by torch; NumPy's writes do not count).
    """

    def __init__(self, num_rows: int, size: int) -> None:
        """Record up to `num_rows` observations with `size` outputs each, from `start` on."""
        self._shape = num_rows, size
        self.outputs = torch.empty(0, size)
        self.recording: Recording | None = None
        """The present batch; None while `outputs` are overwritten, or if they had no room."""

    def start(self) -> None:
        """Allocate the memory, before the next batch."""
        self.outputs = torch.empty(self._shape)

    def record(self, rows: Tensor, weights: Tensor, pixels: Tensor) -> None:
        """Make `outputs` those of a batch; `rows`, (k,), are theirs."""
        if int(rows.max()) < len(self.outputs):
            self.recording = Recording(pixels, pixels._version, weights, rows.int())

    def find(self, pixels: Tensor, weights: Tensor) -> Tensor | None:
        """Return the rows in `outputs` of contiguous observations, (k, numbers), if they have any.

        `weights` are the packed weights, which must be those that gave the outputs.
        """
        recording = self.recording
        if recording is None or pixels._version != recording.version:
            return None
        size = pixels.shape[1] * pixels.element_size()
        first, rest = divmod(pixels.data_ptr() - recording.pixels.data_ptr(), size)
        last = first + len(pixels)
        is_slice = rest == 0 and first >= 0 and last <= len(recording.rows)
        if not (is_slice and torch.equal(weights, recording.weights)):
            return None
        return recording.rows[first:last]


class FusedNetwork(ImageNetwork):
    """Compute a network's logits and gradients in fused kernels, as torch does up to rounding.

    With a small network, torch spends most of its time between matrix products. The fused kernel
    passes blocks of observations through all layers, so that the activations stay in cache.
    """

    def __init__(
        self,
        network: PolicyNetwork | InputsNetwork,
        num_threads: int = 1,
        *,
        wrt: Wrt = "weights",
        activations: ActivationRecorder | None = None,
        critic: nn.Linear | None = None,
    ) -> None:
        super().__init__()
        self.network, self.in_shape, self.actions = network, network.in_shape, network.actions
        self.in_keys, self._critic = network.in_keys, critic
        self._num_threads, self._activations = num_threads, activations
        self._wrt: Wrt = wrt
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
        critic: nn.Linear | None = None,
    ) -> Self | Reasons:
        """Return the fused network, or the reasons why the kernel does not support the network.

        Args:
            network: Network from inputs to logits.
            num_threads: Threads that share the observations; it affects the rounding of sums.
            wrt: Differentiate with respect to the weights, or to the pixels with fixed weights.
            activations: Those of `FusedEpisodes`, which batches from it need not compute again.
            critic: A layer on the features of the last one, whose outputs follow the logits.
        """
        reasons = unsupported(network)
        if not reasons and wrt == "pixels":
            if isinstance(network, InputsNetwork):
                reasons.append("gradients of several inputs are not fused")
            elif not packed_layers(network)[0].has_transpose:
                reasons.append(f"the first layer's inputs are not a multiple of {WIDTH}")
        num_weights = sum(p.numel() for p in network.parameters())
        if num_weights > MAX_WEIGHTS:
            reasons.append(f"{num_weights} weights are more than {MAX_WEIGHTS}")
        if reasons or not isinstance(network, PolicyNetwork | InputsNetwork):
            return Reasons(reasons)
        return cls(network, num_threads, wrt=wrt, activations=activations, critic=critic)

    def forward(self, *inputs: Tensor) -> Tensor:  # pyright: ignore[reportIncompatibleMethodOverride]
        """Return the logits of inputs in the order of `in_keys`, each (*, its shape)."""
        if self._engine is None:
            packed = PackedNetwork(self.network, critic=self._critic)
            self._engine = _Engine(packed, self._num_threads, self._wrt, self._activations)
        self.network.check(*inputs)
        shapes = getattr(self.network, "in_shapes", {self.in_keys[0]: self.in_shape})
        batch = inputs[0].shape[: inputs[0].ndim - len(shapes[self.in_keys[0]])]
        named = sorted(zip(shapes.values(), inputs, strict=True), key=lambda of: len(of[0]) == 1)
        flat = joined([values.reshape(-1, math.prod(shape)) for shape, values in named])
        parameters = self._engine.packed.parameters if self._wrt == "weights" else ()
        return _Logits.apply(self._engine, flat, *parameters).reshape(*batch, -1)


def joined(parts: list[Tensor]) -> Tensor:
    """Return parts, (k, sizes), side by side; a view if they are parts of one tensor."""
    first, sizes = parts[0], [part.shape[1] for part in parts]
    total, memory = sum(sizes), first.untyped_storage().data_ptr()
    is_view = all(
        part.untyped_storage().data_ptr() == memory
        and part.stride() == (total, 1)
        and part.storage_offset() == first.storage_offset() + start
        for part, start in zip(parts, starts(sizes), strict=True)
    )
    return first.as_strided((len(first), total), (total, 1)) if is_view else torch.cat(parts, 1)


def with_fused_passes(
    network: N,
    num_threads: int = 1,
    *,
    wrt: Wrt = "weights",
    activations: ActivationRecorder | None = None,
) -> N | FusedNetwork:
    """Return the `FusedNetwork` of a network if the kernel supports it, else the network itself.

    See `FusedNetwork.try_create` for the arguments.
    """
    fused = FusedNetwork.try_create(network, num_threads, wrt=wrt, activations=activations)
    return network if isinstance(fused, Reasons) else fused


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
    """Run both passes in threads, with packed weights and buffers."""

    def __init__(
        self,
        packed: PackedNetwork,
        num_threads: int,
        wrt: Wrt,
        activations: ActivationRecorder | None,
    ) -> None:
        load_kernels(gradients_kernel).result()
        self.packed, self._activations = packed, activations
        self._has_fixed_weights = wrt == "pixels"
        self._workers = WorkerPool(num_threads, num_threads)
        self._logits_offset, self._size = packed.offsets.outputs[-2:]
        params = self._params = PackedParams()
        params.layers, params.transposed = packed.arrays, packed.transposed
        params.transposed_weights = wp.from_torch(packed.transposed_weights)
        branches = packed.layers[: packed.arrays.num_branch_layers]
        features_offset = packed.offsets.starts[len(branches) - 1]
        params.inputs_stride = odd_lines(self._logits_offset - features_offset)
        sizes = {
            "deltas": int(BLOCK) * self._size,
            "inputs": int(BLOCK) * params.inputs_stride,
            "patches": max(la.num_inputs * math.prod(la.output_shape) for la in branches),
        }
        num_gradients = 0 if self._has_fixed_weights else len(packed.weights)
        self._gradients = torch.empty(self._workers.size, num_gradients)
        self._workspaces = [Workspace() for _ in range(self._workers.size)]
        for workspace, gradients in zip(self._workspaces, self._gradients, strict=True):
            for name, size in sizes.items():
                setattr(workspace, name, wp.empty(size, dtype=float, device="cpu"))
            workspace.gradients = wp.from_torch(gradients)
        self._spare: Tensor | None = None
        """Buffer to reuse for outputs; allocating one takes longer than evaluating a layer."""
        packed.pack()

    def compute(self, pixels: Tensor) -> _Outputs:
        """Return the outputs of all layers, those that were recorded if there are any."""
        if not self._has_fixed_weights:
            self.packed.pack()
        recorder = self._activations
        rows = None if recorder is None else recorder.find(pixels, self.packed.weights)
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
        count = sum(len(module.weight) for module in self.packed.layers[-1].modules)
        last = self._logits_offset + torch.arange(count)
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
        if self._has_fixed_weights:
            return [grad_pixels]
        return self.packed.unpack(self._gradients.sum(0))
