"""Validation of the numbers that commands take, and of a drone's dynamics."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import torch
from torch import Tensor

from drone_rl.config import DynamicsSettings
from drone_rl.sim.dynamics import Quadrotor
from drone_rl.utils.errors import InputError
from drone_rl.utils.schema import shown

FARTHEST = 1e6
"""Greatest magnitude of a coordinate, metres, and by default of any number."""


def real(
    value: Any,
    name: str,
    low: float = -FARTHEST,
    high: float = FARTHEST,
    *,
    is_above: bool = False,
    unit: str = "",
) -> float:
    """Return a finite number from `low` (above it if `is_above`) to `high`.

    Raises:
        InputError: The value is not such a number; the message has its name and unit.
    """
    try:
        number = float(value)
    except (TypeError, ValueError, OverflowError, RuntimeError):
        number = math.nan
    if not low <= number <= high or (is_above and number == low):
        least = f"above {low:g}" if is_above else f"of {low:g} or more"
        words = f"a finite number {least}, up to {high:g}{f' ({unit})' if unit else ''}"
        raise InputError(f"{name}={_shown(value)} is invalid; give {words}")
    return number


def numbers(values: Any, name: str, count: int, low: float, high: float) -> list[float]:
    """Return `count` finite numbers, each from `low` to `high`.

    Raises:
        InputError: The values are not such numbers.
    """
    try:
        given = list(values)
    except TypeError:
        given = []
    if len(given) != count:
        raise InputError(f"{name}={_shown(values)} is invalid; give {count} numbers")
    return [real(value, f"{name}[{i}]", low, high) for i, value in enumerate(given)]


def duration(value: Any, name: str = "duration") -> float:
    """Return a duration in seconds, which must not be negative."""
    return real(value, name, 0.0, unit="s")


def speed(value: Any, name: str = "speed") -> float:
    """Return a speed above 0, at most 100 m/s."""
    return real(value, name, 0.0, 100.0, is_above=True, unit="m/s")


def radians(value: Any, name: str, limit: float = 3600.0) -> float:
    """Convert an angle (or rate) given in degrees, at most `limit` either way."""
    return math.radians(real(value, name, -limit, limit, unit="degrees"))


def time_limit(timeout: float | None, length: float, speed: float) -> float:
    """Return the time limit of a movement of this length (metres) and speed, seconds.

    By default it is three times the expected time plus 10 s; a negative one is an `InputError`.
    """
    if timeout is None:
        return 10.0 + 3.0 * length / speed
    return duration(timeout, "timeout")


def height(value: Any, name: str = "z") -> float:
    """Return a height above the ground, metres; a negative one is an `InputError`."""
    number = real(value, name, unit="m")
    if number < 0.0:
        raise InputError(f"{name}={number:g} is below the ground; z points up here, give 0 or more")
    return number


def path(points: Any) -> Tensor:
    """Return the points (x, y, z) of a path, metres, world frame. Shape: (1, P, 3), float64.

    Raises:
        InputError: The path is empty or a point is invalid.
    """
    try:
        places = np.asarray(points, dtype=np.float64)
    except (TypeError, ValueError, OverflowError, RuntimeError) as error:
        raise InputError(f"path={_shown(points)} is invalid; give points (x, y, z)") from error
    if places.size == 0:
        raise InputError("path has no points; give at least one (x, y, z)")
    if places.ndim != 2 or places.shape[1] != 3:
        raise InputError(f"a path of shape {places.shape} is invalid; give points (x, y, z)")
    for number, place in enumerate(places):
        for axis, value in zip("xyz", place, strict=True):
            check = height if axis == "z" else real
            check(value.item(), f"path[{number}].{axis}")
    return torch.from_numpy(places.copy())[None]


def quadrotor(
    dynamics: DynamicsSettings | Quadrotor | None, changes: Mapping[str, Any]
) -> Quadrotor:
    """Return the dynamics of a drone, AirSim's generic one by default, with settings changed.

    Changes to a `Quadrotor`, whose settings are fixed, are an `InputError`.
    """
    if isinstance(dynamics, Quadrotor):
        if changes:
            raise InputError(f"{', '.join(changes)} and a Quadrotor are given; give one of them")
        return dynamics
    if dynamics is not None and not isinstance(dynamics, DynamicsSettings):
        raise InputError(
            f"dynamics={shown(dynamics)} is no DynamicsSettings; give changes by name, as in "
            "Pilot(mass=1.3), or worlds=Worlds(1, task) for a scene"
        )
    return Quadrotor((dynamics or DynamicsSettings()).replace(mode="simple_flight", **changes))


def _shown(value: Any) -> str:
    """Return a value for a message, on one line."""
    is_simple = isinstance(value, str | int | float)
    return shown(value) if is_simple else " ".join(repr(value).split())
