"""Inputs of policies from what their cameras and sensors give, in and outside of the simulator."""

from collections.abc import Mapping

import numpy as np
import torch
from torch import Tensor

from drone_rl.config.inputs import CLASSES, ImageInput, VectorInput
from drone_rl.config.transforms import Fault
from drone_rl.envs.observer import Pipeline, Starts, frames_of
from drone_rl.utils.errors import InputError
from drone_rl.utils.schema import shown

_FORMS = {
    "rgb": (torch.uint8, (3,), ""),
    "depth": (torch.float32, (), ", metres"),
    "segmentation": (torch.uint8, (), f", 0 to {len(CLASSES) - 1} for {', '.join(CLASSES)}"),
    "normals": (torch.float32, (3,), ""),
}
"""Type, channels and meaning of a camera's readings by modality."""


def reading_form(seen: ImageInput | VectorInput) -> tuple[torch.dtype, tuple[int, ...]]:
    """Return type and shape of one reading: (H, W) or (H, W, 3) of a camera, (n,) of a sensor."""
    if isinstance(seen, VectorInput):
        return torch.float32, (seen.size,)
    dtype, channels, _ = _FORMS[seen.modality]
    return dtype, (*seen.size, *channels)


class Readings:
    """Makes the inputs of a policy from readings of its cameras and sensors, without errors.

    A camera gives RGB, uint8 (N, H, W, 3); depth in metres, (N, H, W), 0 or infinite where there
    is nothing; numbers of `CLASSES`, (N, H, W); or normals, (N, H, W, 3). Vectors, (N, n), are in
    SI units. Stacks of frames remember earlier calls.
    """

    def __init__(self, inputs: Mapping[str, ImageInput | VectorInput]) -> None:
        """Take the descriptions of the inputs by name."""
        self.inputs = inputs
        self.pipelines = {
            name: Pipeline(t.make() for t in seen.transforms if not isinstance(t, Fault))
            for name, seen in inputs.items()
            if isinstance(seen, ImageInput)
        }
        """Transforms of the images."""

    def __call__(self, readings: Mapping[str, Tensor], starts: Starts = True) -> dict[str, Tensor]:
        """Return the inputs of the network by name, given readings as `read` returns them."""
        made = {}
        for name, seen in self.inputs.items():
            values = readings[name]
            if isinstance(seen, ImageInput):
                made[name] = self.pipelines[name](frames_of(seen, values), starts=starts)
            else:
                made[name] = values / seen.scale
        return made

    def read(self, given: Mapping[str, np.ndarray | Tensor], *, single: bool) -> dict[str, Tensor]:
        """Return copies of readings by name as tensors, with a first dimension if `single`.

        Raises:
            InputError: One is missing or unknown, is not of its shape or type, or has NaN.
        """
        names = ", ".join(self.inputs)
        if unknown := [name for name in given if name not in self.inputs]:
            raise InputError(f"{unknown[0]} is no input of the policy; it reads {names}")
        if missing := [name for name in self.inputs if name not in given]:
            raise InputError(f"the policy reads {names}; give {', '.join(missing)}, too")
        read = {name: self._read(name, given[name], single) for name in self.inputs}
        lengths = {name: len(values) for name, values in read.items()}
        if len({*lengths.values()}) > 1:
            counts = ", ".join(f"{name} of {length}" for name, length in lengths.items())
            raise InputError(f"the inputs are of several numbers of drones: {counts}; give as many")
        return read

    def _read(self, name: str, given: np.ndarray | Tensor, single: bool) -> Tensor:
        seen = self.inputs[name]
        (dtype, shape), meaning = reading_form(seen), ""
        if isinstance(seen, ImageInput):
            meaning = _FORMS[seen.modality][2]
        many = f"({', '.join(map(str, shape if single else ('N', *shape)))})"
        form = f"{str(dtype).removeprefix('torch.')} of shape {many}{meaning}"
        values = _copied(given)
        if values is None:
            raise InputError(f"{name}={shown(given)} is no array of numbers; give {form}")
        is_rgb = dtype == torch.uint8 and shape[-1] == 3
        fits = values.dtype == dtype if is_rgb else values.dtype != torch.bool
        if not fits or tuple(values.shape[0 if single else 1 :]) != shape:
            other = "several to act_batch" if single else "one to act"
            raise InputError(
                f"{name} of shape {tuple(values.shape)} and type {values.dtype} does not fit the "
                f"policy; give {form}, or {other}"
            )
        values = values.to(dtype)
        if values.isnan().any():
            raise InputError(f"{name} has NaN; give numbers")
        return values[None] if single else values

    @property
    def memories(self) -> list[Tensor]:
        """What stacks of frames remember. Shapes: (N, *)."""
        stages = [stage for pipeline in self.pipelines.values() for stage in pipeline.stages]
        return [stage.memory for stage in stages if stage.memory is not None]

    @property
    def earlier(self) -> int:
        """Number of earlier frames in the longest stack."""
        return max((pipeline.earlier for pipeline in self.pipelines.values()), default=0)

    def forget(self) -> None:
        """Forget earlier frames."""
        for pipeline in self.pipelines.values():
            pipeline.forget()


def _copied(values: np.ndarray | Tensor) -> Tensor | None:
    """Return a copy as a tensor: cameras reuse buffers, and torch has no negative strides."""
    if isinstance(values, Tensor):
        return values.detach().cpu().clone()
    try:
        return torch.as_tensor(np.array(values))
    except (TypeError, ValueError):  # None, a path, images of several sizes
        return None
