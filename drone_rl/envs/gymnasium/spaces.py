"""Spaces out of what our own environments say of observations and actions."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import torch
from gymnasium import spaces
from torch import Tensor

from drone_rl.config import CameraSettings
from drone_rl.sim.actions import Actions, Entry
from drone_rl.utils.errors import InputError

_MOST = float(np.finfo(np.float32).max)
"""Of a number of which no bound is known: Gymnasium's checker wants finite ones."""


def picture_space(camera: CameraSettings) -> spaces.Box:
    """RGB bytes. Shape: (height, width, 3)."""
    return spaces.Box(0, 255, (camera.height, camera.width, 3), np.uint8)


def vector_space(entries: Mapping[str, Entry]) -> spaces.Box:
    """Entries one after the other, as float32."""
    bounds = [np.tile(_bounds(e), (math.prod(e.shape), 1)) for e in entries.values()]
    low, high = np.concatenate(bounds).T.astype(np.float32)
    return spaces.Box(low, high)


def action_space(entry: Entry) -> spaces.Space[Any]:
    """Numbers of actions where they are counted, else numbers within bounds."""
    low, high = _bounds(entry)
    if entry.dtype != torch.int64:
        return spaces.Box(low, high, entry.shape)
    count = int(high) + 1
    return spaces.MultiDiscrete(np.full(entry.shape, count)) if entry.shape else _counted(count)


def read_action(given: Any, actions: Actions, batch: tuple[int, ...] = ()) -> Tensor:
    """An action, or one a world.

    Args:
        given: By a user.
        actions: What can be done.
        batch: Shape of the worlds; () for a single one.

    Returns:
        Shape: (*batch, *), as `actions.entry` has it.

    Raises:
        InputError: It is none, or not as many as there are worlds.
    """
    entry, (low, high) = actions.entry, _bounds(actions.entry)
    is_whole = entry.dtype == torch.int64
    try:
        array = np.asarray(given)
    except ValueError:  # of ragged lists
        array = np.empty(0, object)
    shape = (*batch, *entry.shape)
    fits = array.shape == shape and array.dtype.kind in ("iu" if is_whole else "iuf")
    if not fits or not ((array >= low) & (array <= high)).all():
        numbers = ", ".join(f"{i} {name}" for i, name in enumerate(actions.names))
        numbers = numbers if is_whole else f"numbers from {low:g} to {high:g}"
        many = f"an array of shape {shape} of" if shape else "one of"
        text = " ".join(repr(given).split())[:80]
        raise InputError(f"action={text} can't be flown; give {many}: {numbers}")
    return torch.as_tensor(array, dtype=entry.dtype)


def _counted(count: int) -> spaces.Space[Any]:
    return spaces.Discrete(count)


def _bounds(entry: Entry) -> tuple[float, float]:
    if entry.dtype == torch.bool:
        return 0.0, 1.0
    low = -_MOST if entry.low is None else float(entry.low)
    return low, _MOST if entry.high is None else float(entry.high)
