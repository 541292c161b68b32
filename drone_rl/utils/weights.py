"""Whether saved tensors are those of the network that they are said to belong to."""

from collections.abc import Mapping
from typing import Any

import torch
from torch import Tensor

from drone_rl.utils.errors import InputError
from drone_rl.utils.schema import as_mapping, shown


def check_weights(weights: Any, expected: Mapping[str, Tensor]) -> dict[str, Tensor]:
    """Refuses all but finite tensors of the expected names, shapes and types.

    Args:
        weights: Out of a file.
        expected: The network's `state_dict`; it may lie on the meta device, without numbers.

    Returns:
        The weights.

    Raises:
        InputError: They differ; the first difference is named.
    """
    found = dict(as_mapping(weights, "the policy's weights"))
    for name in [*expected, *(name for name in found if name not in expected)]:
        _check_shape(name, found.get(name), expected.get(name))
    for name, value in found.items():
        if value.is_floating_point() and not bool(torch.isfinite(value).all()):
            raise InputError(
                f"the weights {name} hold NaN or infinity; use a checkpoint from before that"
            )
    return found


def _check_shape(name: str, found: Any, expected: Tensor | None) -> None:
    there, here = _kind(found), _kind(expected)
    if there != here:
        raise InputError(
            f"the saved weights are not those of the described policy: {shown(name)} is {there} in "
            f"the file and {here} by the description; choose the policy and camera of the training"
        )


def _kind(value: Any) -> str:
    if value is None:
        return "absent"
    if not isinstance(value, Tensor):
        return f"no tensor ({type(value).__name__})"
    kind = "" if value.dtype == torch.float32 else f" of {value.dtype}".replace("torch.", "")
    return f"{tuple(value.shape)}{kind}"
