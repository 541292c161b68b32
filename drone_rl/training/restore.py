"""Check that a saved state fits a training run, before any of it is loaded."""

import copy
from collections.abc import Mapping
from typing import Any

import torch
from torch import Tensor

from drone_rl.utils.errors import InputError


def check_fits(saved: Any, own: Any, where: str) -> None:
    """Check that a saved state has the structure of `own`, whose None fits anything.

    Raises:
        InputError: A name, a type, a length, or the shape of a tensor differs.
    """
    parts: list[tuple[Any, Any, Any]] = []
    if isinstance(own, Tensor):
        fits = isinstance(saved, Tensor) and (saved.shape, saved.dtype) == (own.shape, own.dtype)
        needed = f"is not of shape {tuple(own.shape)} and {own.dtype}"
    elif isinstance(own, Mapping):
        fits, needed = (
            isinstance(saved, Mapping) and set(saved) == set(own),
            "has other names in it",
        )
        parts = [(key, saved[key], own[key]) for key in own] if fits else []
    elif isinstance(own, list | tuple):
        fits = isinstance(saved, list | tuple) and len(saved) == len(own)
        needed = f"is not a list of {len(own)}"
        parts = list(zip(range(len(own)), saved, own, strict=True)) if fits else []
    else:
        fits = own is None or type(saved) in {type(own), *([int] if type(own) is float else [])}
        needed = f"is no {type(own).__name__}"
    if not fits:
        raise InputError(
            f"the checkpoint does not fit this run: {where} {needed}; resume from the checkpoint "
            "of a run with these settings, or start a new run"
        )
    for key, saved_part, own_part in parts:
        check_fits(saved_part, own_part, f"{where}.{key}")


def check_optimizer(saved: Any, optimizer: torch.optim.Optimizer) -> None:
    """Check a state of an optimizer as `check_fits` does, before or after its first step."""
    current = _after_a_step(optimizer)
    if isinstance(saved, Mapping) and saved.get("state") == {}:
        current["state"] = {}
    check_fits(saved, current, "optimizer")


def _after_a_step(optimizer: torch.optim.Optimizer) -> dict[str, Any]:
    """Return the state of a copy after one step along a gradient of 0."""
    again = copy.deepcopy(optimizer)
    for group in again.param_groups:
        for parameter in group["params"]:
            parameter.grad = torch.zeros_like(parameter)
    again.step()
    return again.state_dict()
