"""Numbers that a pilot is given, checked before the drone is told anything."""

import math
from typing import Any

import numpy as np
import torch
from torch import Tensor

from drone_rl.utils.errors import InputError

FARTHEST = 1e6
"""Metres from the origin beyond which nothing is flown to."""


def real(
    value: Any,
    name: str,
    low: float = -FARTHEST,
    high: float = FARTHEST,
    *,
    is_above: bool = False,
    unit: str = "",
) -> float:
    """A finite number within bounds.

    Args:
        value: What was given.
        name: Its name, for people.
        low: The least that it may be.
        high: The most.
        is_above: Whether it must be more than `low`.
        unit: For people.

    Raises:
        InputError: It is no such number.
    """
    try:
        number = float(value)
    except (TypeError, ValueError):
        number = math.nan
    if not low <= number <= high or (is_above and number == low):
        least = f"above {low:g}" if is_above else f"of {low:g} or more"
        words = f"a finite number {least}, up to {high:g}" if low > -FARTHEST else "a finite number"
        raise InputError(f"{name}={value!r} can't be; give {words}{f' ({unit})' if unit else ''}")
    return number


def numbers(values: Any, name: str, count: int, low: float, high: float) -> list[float]:
    """So many finite numbers within bounds.

    Args:
        values: What was given.
        name: Its name, for people.
        count: How many there must be.
        low: The least that each may be.
        high: The most.

    Raises:
        InputError: They are others, more or fewer.
    """
    try:
        given = list(values)
    except TypeError:
        given = []
    if len(given) != count:
        raise InputError(f"{name}={values!r} can't be; give {count} numbers")
    return [real(value, f"{name}[{i}]", low, high) for i, value in enumerate(given)]


def duration(value: Any) -> float:
    """Seconds that a command lasts.

    Raises:
        InputError: It is negative or no number.
    """
    return real(value, "duration", 0.0, unit="s")


def speed(value: Any, name: str = "speed") -> float:
    """Metres a second.

    Raises:
        InputError: It is not above 0, or absurd.
    """
    return real(value, name, 0.0, 100.0, is_above=True, unit="m/s")


def height(value: Any, name: str = "z") -> float:
    """Metres above the ground.

    Raises:
        InputError: It is below the ground.
    """
    number = real(value, name, unit="m")
    if number < 0.0:
        raise InputError(f"{name}={number:g} is below the ground; z points up here, give 0 or more")
    return number


def path(points: Any) -> Tensor:
    """Points to fly through, in order.

    Args:
        points: Places (x, y, z), metres, world frame: an array, a tensor or a list.

    Returns:
        Shape: (1, P, 3), float64.

    Raises:
        InputError: There are none, or one of them is no place.
    """
    try:
        places = np.asarray(points, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(f"path={points!r} has no places; give some of (x, y, z)") from error
    if places.size == 0:
        raise InputError("path has no points; give at least one (x, y, z)")
    if places.ndim != 2 or places.shape[1] != 3:
        raise InputError(f"a path of shape {places.shape} has no places; give points of (x, y, z)")
    for number, place in enumerate(places):
        for axis, value in zip("xyz", place, strict=True):
            check = height if axis == "z" else real
            check(value.item(), f"path[{number}].{axis}")
    return torch.from_numpy(places.copy())[None]
