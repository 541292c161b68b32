"""Validation of the numbers that commands take, and of a drone's dynamics."""

import functools
import inspect
from collections.abc import Callable, Mapping
from typing import Annotated, Any, TypeVar, cast

import numpy as np
import pydantic
from torch import Tensor

from drone_rl.config import DynamicsSettings
from drone_rl.sim.dynamics import Quadrotor
from drone_rl.utils.errors import InputError
from drone_rl.utils.models import input_error
from drone_rl.utils.schema import Instance, Real, Several, as_plain, shown

F = TypeVar("F", bound=Callable[..., Any])
FARTHEST = 1e6
"""Greatest magnitude of a coordinate, metres, and by default of any number."""
COORDINATE = Real(-FARTHEST, FARTHEST)
Coordinate = Annotated[float, COORDINATE]
Height = Annotated[float, Real(0.0, FARTHEST)]
"""Metres above the ground."""
Duration = Annotated[float, Real(0.0, FARTHEST)]
"""Seconds."""
Speed = Annotated[float, Real(0.0, 100.0, is_above=True)]
"""Metres per second."""
Velocity = Annotated[float, Real(-100.0, 100.0)]
DEGREES = Real(-3600.0, 3600.0)
Degrees = Annotated[float, DEGREES]
"""Of an angle, or a rate per second."""
Tilt = Annotated[float, Real(-90.0, 90.0)]
"""Degrees of roll or pitch."""
SHARE = Real(0.0, 1.0)
Share = Annotated[float, SHARE]


def checked(function: F) -> F:
    """Check a method's arguments by its annotations; an `InputError` names a wrong one."""
    signature, validate = inspect.signature(function), pydantic.validate_call(function)

    @functools.wraps(function)
    def call(*args: Any, **kwargs: Any) -> Any:
        given = signature.bind(*args, **kwargs).arguments
        try:
            return validate(**{name: as_plain(value) for name, value in given.items()})
        except pydantic.ValidationError as error:
            raise input_error(error) from None

    return cast(F, call)


def numbers(values: Any, name: str, count: int, kind: Real = COORDINATE) -> tuple[float, ...]:
    """Return `count` numbers of a sequence, array or tensor; an `InputError` if it has others."""
    items = values.tolist() if isinstance(values, Tensor | np.ndarray) else values
    return Several(kind, count, count).read(items, name)


def time_limit(timeout: float | None, length: float, speed: float) -> float:
    """Return the time limit of a movement of this length (metres) and speed, seconds.

    By default it is three times the expected time plus 10 s.
    """
    return 10.0 + 3.0 * length / speed if timeout is None else timeout


_POINTS = Several(Instance(tuple[Coordinate, Coordinate, Height]), 1, 1_000_000)


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
    _POINTS.read(places.tolist(), "path")
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
