"""Policies as ONNX models: from a camera's frame to probabilities, for programs without torch."""

import contextlib
import json
import logging
import warnings
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import torch
from torch import Tensor, nn

from drone_rl.envs import on_pixels
from drone_rl.policies import PolicyNetwork
from drone_rl.policies.zoo.description import PolicyDescription
from drone_rl.utils.errors import InputError, extra

FRAMES, PROBABILITIES, ACTION = "frames", "probabilities", "action"
"""Names of the model's input and outputs."""
_ASKED_BY = "format=onnx"


class _FullPolicy(nn.Module):
    """Transforms, network and probabilities: RGB (N, H, W, 3), uint8, to outputs of the model."""

    def __init__(self, description: PolicyDescription, network: PolicyNetwork) -> None:
        super().__init__()
        if description.frames > 1:
            raise InputError(
                "the policy sees a stack of frames, but an ONNX model is given one at a time; "
                "export it with format=safetensors"
            )
        self._network = network
        self._transform = on_pixels(description.make_transforms())
        self.has_action = bool(network.actions.entry.shape)
        """Whether there is an output for the action, which is not the most probable part."""

    def forward(self, frames: Tensor) -> Tensor | tuple[Tensor, Tensor]:
        actions, outputs = self._network.actions, self._network(self._transform(frames))
        probs = actions.probabilities(outputs)
        return (probs, actions.greedy(outputs)) if self.has_action else probs


def make_onnx(
    description: PolicyDescription, network: PolicyNetwork, about: Mapping[str, Any]
) -> bytes:
    """Return a policy as an ONNX model.

    The input is "frames", RGB of the camera, uint8 (N, H, W, 3) for any N from 1. The output is
    "probabilities", of each action, float32 (N, A). Of continuous actions they are those of their
    parts, see `Actions.probabilities`, and a second output is "action", float32 (N, 3). The
    metadata are JSON: the description by its keys, "actions", names in the order of the first
    output, and `about`.

    Raises:
        InputError: The policy needs several frames, ONNX does not support it, or lacks a package.
    """
    extra("onnxscript", "onnx", _ASKED_BY)  # which torch's exporter needs
    passes = extra("onnx_ir.passes.common", "onnx", _ASKED_BY)
    policy, camera = _FullPolicy(description, network).eval(), description.camera
    sample = torch.zeros(2, camera.height, camera.width, 3, dtype=torch.uint8)
    try:
        with _silence():
            program = torch.onnx.export(
                policy,
                (sample,),
                dynamo=True,
                input_names=[FRAMES],
                output_names=[PROBABILITIES, ACTION][: 1 + policy.has_action],
                dynamic_shapes=({0: torch.export.Dim("N")},),
                verbose=False,
            )
    except torch.onnx.OnnxExporterError as error:
        reason = str(error).strip().splitlines()[-1][:200]
        raise InputError(
            f"the policy can't be written as an ONNX model ({reason}); export it with "
            "format=safetensors"
        ) from error
    assert program is not None  # torch returns none only where it compiles by halves
    passes.ClearMetadataAndDocStringPass()(program.model)  # the exporter's own notes
    told = {**description.as_dict(), "actions": list(network.actions.names), **about}
    program.model.metadata_props.update({key: json.dumps(value) for key, value in told.items()})
    return program.model_proto.SerializeToString()


def open_onnx(content: bytes) -> Callable[[Tensor], Tensor]:
    """Return a model of `make_onnx` as a function of frames; it needs onnxruntime."""
    runtime = extra("onnxruntime", "onnx", _ASKED_BY)
    options = runtime.SessionOptions()
    options.intra_op_num_threads = 1  # more would only wait for torch's, and sums depend on them
    session = runtime.InferenceSession(content, options)

    def probabilities(frames: Tensor) -> Tensor:
        (found,) = session.run([PROBABILITIES], {FRAMES: frames.numpy()})
        return torch.from_numpy(found)

    return probabilities


@contextlib.contextmanager
def _silence() -> Iterator[None]:
    """Suppress warnings and logs of torch's exporter."""
    before = logging.root.manager.disable
    logging.disable(logging.WARNING)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        logging.disable(before)
