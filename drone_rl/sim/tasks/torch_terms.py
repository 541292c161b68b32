"""Terms in torch: functions of the steps of all environments, between two kernels of a step."""

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import torch
from torch import Tensor

from drone_rl.config.terms import Term
from drone_rl.utils.errors import InputError
from drone_rl.utils.plugins import described, errors_of, place_of


class Steps(SimpleNamespace):
    """A step of N environments: what terms in torch read.

    It has the fields of a `Step` as tensors, such as `position`, (N, 3), and `distance`, (N,).
    """


def values_of(term: Term, steps: Any, parameters: Sequence[float], device: torch.device) -> Tensor:
    """Return the values of a term in torch. Shape: (N,), float64.

    Args:
        term: The term.
        steps: Warp's array of N `Step`s.
        parameters: The term's parameters.
        device: Device of the tensors.

    Raises:
        InputError: The function fails, or its values have another shape or are not finite.
    """
    seen, place = steps.numpy(), place_of(term.function) if term.function else term.name
    fields = {name: torch.tensor(seen[name], device=device) for name in seen.dtype.names}
    with errors_of(f"the term {term.name}", place), torch.no_grad():
        values: Any = term.function(Steps(**fields), *parameters)  # pyright: ignore[reportOptionalCall]
    if not isinstance(values, Tensor) or values.shape != (len(seen),):
        raise InputError(
            f"{place}: the term {term.name} returns {described(values)}; return a tensor of shape "
            f"({len(seen)},), a value for each environment"
        )
    values = values.to(device, torch.float64)
    if not bool(values.isfinite().all()):
        raise InputError(
            f"{place}: the term {term.name} has values that are not finite; correct it, such as a "
            "division by 0 or a logarithm of it"
        )
    return values
