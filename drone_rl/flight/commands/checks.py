"""Validation of the numbers that commands take, and of a drone's dynamics."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from torch import Tensor

from drone_rl.config import DynamicsSettings
from drone_rl.sim.dynamics import Quadrotor
from drone_rl.utils.errors import InputError
from drone_rl.utils.schema import Real, Several, shown

FARTHEST = 1e6
"""Greatest magnitude of a coordinate, metres, and by default of any number."""
COORDINATE = Real(-FARTHEST, FARTHEST)
DURATION = Real(0.0, FARTHEST)
"""Seconds."""
SPEED = Real(0.0, 100.0, is_above=True)
"""Metres per second."""
SHARE = Real(0.0, 1.0)


def numbers(values: Any, name: str, count: int, kind: Real = COORDINATE) -> tuple[float, ...]:
    """Return `count` numbers of a sequence, array or tensor; an `InputError` if it has others."""
    items = values.tolist() if isinstance(values, Tensor | np.ndarray) else values
    return Several(kind, count, count).read(items, name)


def degrees(value: Any, name: str, limit: float = 3600.0) -> float:
    """Return an angle or rate in degrees, at most `limit` either way."""
    return Real(-limit, limit).read(value, name)


def radians(value: Any, name: str, limit: float = 3600.0) -> float:
    """Convert an angle or rate in degrees, at most `limit` either way."""
    return math.radians(degrees(value, name, limit))


def height(value: Any, name: str = "z") -> float:
    """Return a height above the ground, metres; a negative one is an `InputError`."""
    number = COORDINATE.read(value, name)
    if number < 0.0:
        raise InputError(f"{name}={number:g} is below the ground; z points up here, give 0 or more")
    return number


def time_limit(timeout: float | None, length: float, speed: float) -> float:
    """Return the time limit of a movement of this length (metres) and speed, seconds.

    By default it is three times the expected time plus 10 s; a negative one is an `InputError`.
    """
    return 10.0 + 3.0 * length / speed if timeout is None else DURATION.read(timeout, "timeout")


def path(points: Any) -> list[list[float]]:
    """Return the points (x, y, z) of a path, metres, world frame.

    Raises:
        InputError: The path is empty or a point is invalid.
    """
    try:
        places: np.ndarray = np.array(points, dtype=np.float64)
    except (TypeError, ValueError, OverflowError, RuntimeError):
        places = np.zeros(0)
    if places.ndim != 2 or places.shape[1] != 3 or not len(places):
        raise InputError(f"path={shown(points)} has no points; give some, each (x, y, z)")
    for number, (x, y, z) in enumerate(places.tolist()):
        COORDINATE.read(x, f"path[{number}].x")
        COORDINATE.read(y, f"path[{number}].y")
        height(z, f"path[{number}].z")
    return places.tolist()


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
