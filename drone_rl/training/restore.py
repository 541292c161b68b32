"""Check that a saved state fits a training run, before any of it is loaded."""

import copy
import math
from collections.abc import Mapping, Sequence
from typing import Any

import torch
from torch import Tensor

from drone_rl.utils.errors import InputError
from drone_rl.utils.schema import shown

MAY_DIFFER = ("lr", "initial_lr")
"""Entries of an optimizer's parameter groups that a scheduler changes or adds."""


def check_fits(saved: Any, own: Any, where: str) -> None:
    """Check that a saved state has the structure of `own`, whose None fits anything.

    Raises:
        InputError: A key, type, shape, length, text or flag differs; a number is infinite or
            NaN where `own` has no such number.
    """
    if isinstance(own, Tensor):
        _check_tensor(saved, own, where)
    elif isinstance(own, Mapping):
        if not isinstance(saved, Mapping) or set(saved) != set(own):
            raise _misfit(where, "has other names in it")
        for key, value in own.items():
            check_fits(saved[key], value, f"{where}.{key}")
    elif isinstance(own, list | tuple):
        _check_list(saved, own, where)
    elif own is not None:
        _check_value(saved, own, where)


def check_optimizer(saved: Any, optimizer: torch.optim.Optimizer) -> None:
    """Check a state of an optimizer as `check_fits` does, and its hyperparameters."""
    own = _after_a_step(optimizer)
    if isinstance(saved, Mapping) and saved.get("state") == {}:
        own["state"] = {}
    check_fits(saved, own, "optimizer")
    for mine, theirs in zip(own["param_groups"], saved["param_groups"], strict=True):
        for key in mine:
            values = [list(v[key]) if isinstance(v[key], tuple) else v[key] for v in (mine, theirs)]
            if key not in MAY_DIFFER and values[0] != values[1]:
                raise _misfit(
                    f"optimizer.{key}", f"is {shown(theirs[key])}, not {shown(mine[key])}"
                )


def _after_a_step(optimizer: torch.optim.Optimizer) -> dict[str, Any]:
    """Return the state of a copy after one step along a gradient of 0."""
    again = copy.deepcopy(optimizer)
    for group in again.param_groups:
        for parameter in group["params"]:
            parameter.grad = torch.zeros_like(parameter)
    again.step()
    return again.state_dict()


def _check_list(saved: Any, own: Sequence[Any], where: str) -> None:
    if not isinstance(saved, list | tuple) or len(saved) != len(own):
        raise _misfit(where, f"is not a list of {len(own)}")
    for i, (one, other) in enumerate(zip(saved, own, strict=True)):
        check_fits(one, other, f"{where}[{i}]")


def _check_value(saved: Any, own: Any, where: str) -> None:
    if type(own) is int:
        fits = type(saved) is int
    elif type(own) is float:
        fits = type(saved) in (int, float) and math.isfinite(saved)
    else:
        fits = type(saved) is type(own) and saved == own
    if not fits:
        raise _misfit(where, f"is {shown(saved)}, but here it is {shown(own)}")


def _check_tensor(saved: Any, own: Tensor, where: str) -> None:
    if not isinstance(saved, Tensor) or (saved.shape, saved.dtype) != (own.shape, own.dtype):
        raise _misfit(where, f"is not of shape {tuple(own.shape)} and {own.dtype}")
    if saved.is_floating_point():  # environments store unknowns as NaN or infinity
        nan = torch.isnan(saved) & bool(torch.isnan(own).any())  # `own` may be on a GPU
        infinite = torch.isinf(saved) & bool(torch.isinf(own).any())
        if not bool((torch.isfinite(saved) | nan | infinite).all()):
            raise _misfit(where, "holds NaN or infinity")


def _misfit(where: str, what: str) -> InputError:
    return InputError(
        f"the checkpoint does not fit this run: {where} {what}; resume from the checkpoint of "
        "a run with these settings, or start a new run"
    )
