"""Policies as ONNX models: from readings to probabilities, for programs without torch."""

import contextlib
import json
import logging
import warnings
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from drone_rl.config.inputs import PIXELS
from drone_rl.envs.readings import Readings, reading_form
from drone_rl.policies import ImageNetwork, RecurrentNetwork
from drone_rl.policies.recurrent import Memory
from drone_rl.policies.zoo.description import PolicyDescription
from drone_rl.utils.errors import InputError, extra

FRAMES, PROBABILITIES, ACTION = "frames", "probabilities", "action"
STATE, NEXT_STATE = ("hidden", "cell"), ("next_hidden", "next_cell")
"""Names of the model's inputs and outputs; only recurrent models have the states. Other inputs than
"pixels" have their own names."""
_SETTING = "format=onnx"


class _FullPolicy(nn.Module):
    """Transforms, network and probabilities: readings of cameras and sensors to outputs."""

    def __init__(self, description: PolicyDescription, network: ImageNetwork) -> None:
        super().__init__()
        if description.frames > 1:
            raise InputError(
                "the policy sees a stack of frames, but an ONNX model is given one at a time; "
                "export it with format=safetensors"
            )
        self._network, self._readings = network, Readings(description.inputs)
        self.has_action = bool(network.actions.entry.shape)
        """Whether there is an output for the action, which is not the most probable part."""

    def forward(self, *given: Tensor) -> tuple[Tensor, ...]:
        actions, network, names = self._network.actions, self._network, [*self._readings.inputs]
        seen = self._readings(dict(zip(names, given, strict=False)))
        following: tuple[Tensor, ...] = ()
        if isinstance(network, RecurrentNetwork):
            outputs, following = network.step(seen[PIXELS], Memory(*given[len(names) :]))
        else:
            outputs = network(*seen.values())
        decided = (actions.greedy(outputs),) if self.has_action else ()
        return (actions.probabilities(outputs), *decided, *following)


def make_onnx(
    description: PolicyDescription, network: ImageNetwork, about: Mapping[str, Any]
) -> bytes:
    """Return a policy as an ONNX model.

    The input is "frames", RGB of the camera, uint8 (N, H, W, 3) for any N from 1; a policy of
    several inputs has them by name, see `drone_rl.envs.readings`. The output is "probabilities",
    of each action, float32 (N, A). Of continuous actions they are those of their parts, see
    `Actions.probabilities`, and a second output is "action", float32 (N, 3). A recurrent model has
    further inputs, "hidden" and "cell", float32 (N, 1, size), zero when an episode starts, and
    further outputs, "next_hidden" and "next_cell", to pass with the next frame. The metadata are
    JSON: "description", as in policy files; "actions", names in the order of the first output; and
    `about`.

    Raises:
        InputError: The policy needs several frames, a package is missing, or ONNX lacks a part.
    """
    extra("onnxscript", "onnx", _SETTING)  # which torch's exporter needs
    passes = extra("onnx_ir.passes.common", "onnx", _SETTING)
    policy = _FullPolicy(description, network).eval()
    forms = {name: reading_form(seen) for name, seen in description.inputs.items()}
    samples = [torch.zeros(2, *shape, dtype=dtype) for dtype, shape in forms.values()]
    names = [FRAMES] if description.sees_pixels else [*forms]
    state = network.start(2) if isinstance(network, RecurrentNetwork) else ()
    any_number = {0: torch.export.Dim("N")}
    try:
        with _silence():
            program = torch.onnx.export(
                policy,
                (*samples, *state),
                dynamo=True,
                input_names=[*names, *STATE[: len(state)]],
                output_names=[
                    *(PROBABILITIES, ACTION)[: 1 + policy.has_action],
                    *NEXT_STATE[: len(state)],
                ],
                dynamic_shapes=((any_number,) * (len(samples) + len(state)),),
                verbose=False,
            )
    except torch.onnx.OnnxExporterError as error:
        reason = str(error).strip().splitlines()[-1][:200]
        raise InputError(
            f"the policy can't be written as an ONNX model ({reason}); export it with "
            "format=safetensors"
        ) from error
    assert program is not None  # torch returns None only with dynamo=False
    passes.ClearMetadataAndDocStringPass()(program.model)  # the exporter's own notes
    metadata = {"actions": list(network.actions.names), **about}
    texts = {key: json.dumps(value) for key, value in metadata.items()}
    texts["description"] = description.model_dump_json()
    program.model.metadata_props.update(texts)
    return program.model_proto.SerializeToString()


def open_onnx(content: bytes) -> Callable[..., Tensor]:
    """Return a model of `make_onnx` as a function of its inputs in order; it needs onnxruntime.

    A recurrent model is also given which episodes start, bool (N, 1), and keeps its state.
    """
    runtime = extra("onnxruntime", "onnx", _SETTING)
    options = runtime.SessionOptions()
    options.intra_op_num_threads = 1  # more would only wait for torch's, and sums depend on them
    session = runtime.InferenceSession(content, options)

    entries = session.get_inputs()
    names = [entry.name for entry in entries if entry.name not in STATE]
    sizes = {entry.name: entry.shape[-1] for entry in entries[len(names) :]}
    state: dict[str, np.ndarray] = {}

    def probabilities(*readings: Tensor, is_init: Tensor | None = None) -> Tensor:
        for name, size in sizes.items():
            assert is_init is not None
            before = state.get(name, np.zeros((len(is_init), 1, size), np.float32))
            state[name] = np.where(is_init.numpy()[..., None], np.float32(0), before)
        outputs = [PROBABILITIES, *NEXT_STATE[: len(sizes)]]
        given = {n: values.numpy() for n, values in zip(names, readings, strict=True)}
        chances, *following = session.run(outputs, {**given, **state})
        state.update(zip(sizes, following, strict=True))
        return torch.from_numpy(chances)

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
