"""Values on the wire: maps with AirSim's keys, in NED, from and to the simulator's tensors."""

import datetime
import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import torch
from torch import Tensor

from drone_rl.flight.airsim.calls import remark
from drone_rl.flight.commands.checks import FARTHEST
from drone_rl.flight.commands.path_following import Drivetrain, YawMode
from drone_rl.sim.coordinates import GeoPoint, ned_attitude_from_world, ned_from_world
from drone_rl.utils.errors import InputError
from drone_rl.utils.schema import shown

Map = dict[str, Any]
NANOSECONDS = 1_000_000_000
MAX_POINTS = 10_000
"""Most points of a path."""
MAX_NAME = 50
"""Most letters of a new name."""
MAX_PATTERN = 200
"""Most letters of a regular expression."""
MOST_TURN = 3600.0
"""Greatest yaw rate, degrees per second."""
_LARGEST = 3.5e38
"""Above all finite float32, such as AirSim's default timeout of 3e38."""


class Pose(NamedTuple):
    """A pose in NED, metres; attitudes are quaternions (w, x, y, z) of FRD bodies.

    Components may be NaN, for no change or for no such object.
    """

    position: tuple[float, float, float]
    attitude: tuple[float, float, float, float]


NO_POSE = Pose((math.nan, math.nan, math.nan), (math.nan, math.nan, math.nan, math.nan))
"""Of an object that does not exist."""


def vector(values: Sequence[float]) -> Map:
    """Return a Vector3r."""
    x, y, z = values
    return {"x_val": float(x), "y_val": float(y), "z_val": float(z)}


def quaternion(values: Sequence[float]) -> Map:
    """Return a Quaternionr of (w, x, y, z)."""
    w, x, y, z = values
    return {"w_val": float(w), "x_val": float(x), "y_val": float(y), "z_val": float(z)}


def pose(of: Pose) -> Map:
    """Return a Pose; clients of version 1.1 read its keys in this order."""
    return {"position": vector(of.position), "orientation": quaternion(of.attitude)}


def geo_point(of: GeoPoint | Sequence[float]) -> Map:
    """Return a GeoPoint of degrees and metres."""
    latitude, longitude, altitude = of
    return {
        "latitude": float(latitude),
        "longitude": float(longitude),
        "altitude": float(altitude),
    }


def nanoseconds(seconds: float) -> int:
    """Convert seconds to a time stamp of AirSim; negative ones become 0."""
    return max(0, round(seconds * NANOSECONDS))


def read_date(text: str) -> int:
    """Return the nanoseconds from 1970 to a date and time, ISO 8601, by default UTC.

    Raises an `InputError` if it is none, or before 1970.
    """
    try:
        found = datetime.datetime.fromisoformat(text)
    except ValueError as error:
        raise InputError(
            f"date={shown(text)} is no date and time; give YYYY-MM-DDTHH:MM:SS"
        ) from error
    seconds = (found if found.tzinfo else found.replace(tzinfo=datetime.UTC)).timestamp()
    if seconds < 0.0:
        raise InputError(f"date={shown(text)} is before 1970; give a later one")
    return nanoseconds(seconds)


def ned(values: Tensor) -> list[float]:
    """Convert a vector of our world, or of our body's frame, to NED or FRD. Shape: (1, 3)."""
    return ned_from_world(values[0].double()).tolist()


def ned_attitude(values: Tensor) -> list[float]:
    """Convert an attitude (1, 4) to that of an FRD body in NED."""
    return ned_attitude_from_world(values[0].double()).tolist()


def to_world(values: Sequence[float]) -> tuple[float, float, float]:
    """Convert a vector in NED to our world; the inverse of `ned`."""
    x, y, z = values
    return x, 0.0 - y, 0.0 - z  # not -0.0


def attitude_to_world(values: Sequence[float]) -> Tensor:
    """Convert an attitude of an FRD body in NED, normalized, to ours. Shape: (1, 4).

    Raises an `InputError` if it has no length.
    """
    given = torch.tensor([list(values)], dtype=torch.float64)
    length = float(given.norm())
    if not 1e-6 < length < math.inf:
        raise InputError(f"orientation={list(values)} is no rotation; give a unit quaternion")
    return ned_attitude_from_world(given / length)


# What clients send


def number(value: Any, name: str, low: float = -_LARGEST, high: float = _LARGEST) -> float:
    """Return a number, limited to `low` and `high` with a remark; an `InputError` if it is none."""
    if isinstance(value, bool) or not isinstance(value, int | float) or math.isnan(value):
        raise InputError(f"{name}={shown(value)} is not a number; give one")
    limited = min(max(value, low), high)
    if limited != value:
        remark(f"{name} is limited to {limited:g}")
    return float(limited)


def whole(value: Any, name: str, low: int, high: int) -> int:
    """Return a whole number from `low` to `high`, else raise an `InputError`."""
    found = number(value, name)
    if not low <= found <= high or found != int(found):
        raise InputError(f"{name}={shown(value)} is out of range; give {low} to {high}")
    return int(found)


def flag(value: Any, name: str) -> bool:
    """Return true or false; of numbers only 0 is false."""
    if isinstance(value, bool) or type(value) in (int, float):
        return bool(value)
    raise InputError(f"{name}={shown(value)} is neither true nor false; give one of them")


def text(value: Any, name: str, most: int = 10_000) -> str:
    """Return a text of at most so many letters; bytes, which old clients send, are decoded."""
    if isinstance(value, bytes):
        value = value.decode("utf-8", "replace")
    if not isinstance(value, str) or len(value) > most:
        raise InputError(
            f"{name}={shown(value)} is not a text of at most {most:,} letters; give one"
        )
    return value


def read_map(
    value: Any,
    name: str,
    keys: Sequence[str],
    *,
    can_be_nan: bool = False,
    most: float = _LARGEST,
) -> list[float]:
    """Return the numbers of a map, in the order of `keys`; other keys are ignored.

    Numbers are limited to `most` in magnitude. Raises an `InputError` if it is no map, or a value
    is missing or no number; NaN is accepted if `can_be_nan`.
    """
    if not isinstance(value, Mapping):
        raise InputError(f"{name}={shown(value)} is not a map; give {', '.join(keys)}")
    found = []
    for key in keys:
        given = value.get(key, value.get(key.encode()))
        if can_be_nan and isinstance(given, float) and math.isnan(given):
            found.append(given)
        else:
            found.append(number(given, f"{name}.{key}", -most, most))
    return found


def read_vector(
    value: Any, name: str, *, can_be_nan: bool = False, most: float = _LARGEST
) -> tuple[float, float, float]:
    """Return the numbers of a Vector3r; errors as of `read_map`."""
    x, y, z = read_map(value, name, ("x_val", "y_val", "z_val"), can_be_nan=can_be_nan, most=most)
    return x, y, z


def read_pose(value: Any, name: str = "pose") -> Pose:
    """Return a Pose, whose components may be NaN; errors as of `read_map`.

    Coordinates are limited to `checks.FARTHEST` in magnitude.
    """
    parts = [_part(value, name, part) for part in ("position", "orientation")]
    keys = ("w_val", "x_val", "y_val", "z_val")
    w, x, y, z = read_map(parts[1], f"{name}.orientation", keys, can_be_nan=True)
    position = read_vector(parts[0], f"{name}.position", can_be_nan=True, most=FARTHEST)
    return Pose(position, (w, x, y, z))


def _part(value: Any, name: str, part: str) -> Any:
    if not isinstance(value, Mapping):
        raise InputError(f"{name}={shown(value)} is not a map; give position and orientation")
    return value.get(part, value.get(part.encode()))


def read_path(value: Any, name: str = "path") -> list[tuple[float, float, float]]:
    """Return the points of a path, at least one; errors as of `read_map`."""
    if not isinstance(value, list | tuple) or not 0 < len(value) <= MAX_POINTS:
        raise InputError(f"{name} is not a list of 1 to {MAX_POINTS} points; give one")
    return [read_vector(point, name, most=FARTHEST) for point in value]


def read_yaw_mode(value: Any, drivetrain: Any) -> tuple[str, YawMode]:
    """Return the drivetrain and the yaw mode of a movement.

    Raises:
        InputError: Numbers are wrong, or a rate other than 0 is combined with ForwardOnly.
    """
    is_forward = whole(drivetrain, "drivetrain", 0, 1) == 1
    if not isinstance(value, Mapping):
        raise InputError(f"yaw_mode={shown(value)} is not a map; give is_rate and yaw_or_rate")
    is_rate = flag(value.get("is_rate", value.get(b"is_rate")), "yaw_mode.is_rate")
    most = MOST_TURN if is_rate else _LARGEST
    (amount,) = read_map(value, "yaw_mode", ("yaw_or_rate",), most=most)
    if is_forward and is_rate:
        if amount != 0.0:
            raise InputError("Yaw cannot be specified as rate if drivetrain is ForwardOnly")
        is_rate = False
    kind = Drivetrain.FORWARD_ONLY if is_forward else Drivetrain.MAX_DEGREE_OF_FREEDOM
    return kind, YawMode(is_rate, math.remainder(amount, 360.0) if not is_rate else amount)
