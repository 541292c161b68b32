"""Values on the wire: maps with AirSim's keys, in NED, from and to the simulator's tensors."""

import datetime
import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, Self

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
LONGEST = 1e6
"""Longest timeout or duration, seconds."""
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

    position: Sequence[float]
    attitude: Sequence[float]

    @classmethod
    def of(cls, position: Tensor, attitude: Tensor) -> Self:
        """Convert a position (3,) and an attitude (4,) of our world."""
        return cls(ned(position), tuple(ned_attitude_from_world(attitude.double()).tolist()))

    def merged(self, now: "Pose") -> "Pose":
        """Replace NaN coordinates, and an attitude with NaN, by those of another pose."""
        is_turned = not any(map(math.isnan, self.attitude))
        attitude = self.attitude if is_turned else now.attitude
        return Pose(known(self.position, now.position), attitude)


NO_POSE = Pose((math.nan,) * 3, (math.nan,) * 4)
"""Of an object that does not exist."""


def known(values: Sequence[float], others: Sequence[float]) -> tuple[float, ...]:
    """Replace NaN values by others."""
    return tuple(o if math.isnan(v) else v for v, o in zip(values, others, strict=True))


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
        date = datetime.datetime.fromisoformat(text)
    except ValueError as error:
        raise InputError(
            f"date={shown(text)} is no date and time; give YYYY-MM-DDTHH:MM:SS"
        ) from error
    seconds = (date if date.tzinfo else date.replace(tzinfo=datetime.UTC)).timestamp()
    if seconds < 0.0:
        raise InputError(f"date={shown(text)} is before 1970; give a later one")
    return nanoseconds(seconds)


def ned(values: Tensor) -> tuple[float, ...]:
    """Convert a vector of our world, or of our body's frame, to NED or FRD. Shape: (3,)."""
    return tuple(ned_from_world(values.double()).tolist())


def to_world(values: Sequence[float]) -> tuple[float, float, float]:
    """Convert a vector in NED to our world; the inverse of `ned`."""
    x, y, z = values
    return x, 0.0 - y, 0.0 - z  # not -0.0


def attitude_to_world(values: Sequence[float]) -> Tensor:
    """Convert an attitude of an FRD body in NED, normalized, to ours. Shape: (4,).

    Raises an `InputError` if it has no length.
    """
    attitude = torch.tensor(values, dtype=torch.float64)
    length = float(attitude.norm())
    if not 1e-6 < length < math.inf:
        raise InputError(f"orientation={[*values]} is no rotation; give a unit quaternion")
    return ned_attitude_from_world(attitude / length)


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
    real = number(value, name)
    if not low <= real <= high or real != int(real):
        raise InputError(f"{name}={shown(value)} is out of range; give {low} to {high}")
    return int(real)


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
    most: float = _LARGEST,
    *,
    can_be_nan: bool = False,
) -> list[float]:
    """Return the numbers of a map, in the order of `keys`; other keys are ignored.

    Numbers are limited to `most` in magnitude. Raises an `InputError` if it is no map, or a value
    is missing or no number; NaN is accepted if `can_be_nan`.
    """
    numbers = []
    for key in keys:
        item = part(value, name, key)
        if can_be_nan and isinstance(item, float) and math.isnan(item):
            numbers.append(item)
        else:
            numbers.append(number(item, f"{name}.{key}", -most, most))
    return numbers


def read_vector(
    value: Any, name: str, most: float = _LARGEST, *, can_be_nan: bool = False
) -> list[float]:
    """Return the numbers of a Vector3r; errors as of `read_map`."""
    return read_map(value, name, ("x_val", "y_val", "z_val"), most, can_be_nan=can_be_nan)


def read_attitude(value: Any, name: str, *, can_be_nan: bool = False) -> list[float]:
    """Return the numbers of a Quaternionr, w first; errors as of `read_map`."""
    return read_map(value, name, ("w_val", "x_val", "y_val", "z_val"), can_be_nan=can_be_nan)


def read_pose(value: Any, name: str = "pose") -> Pose:
    """Return a Pose, whose components may be NaN; errors as of `read_map`.

    Coordinates are limited to `checks.FARTHEST` in magnitude.
    """
    place, turn = (part(value, name, key) for key in ("position", "orientation"))
    position = read_vector(place, f"{name}.position", can_be_nan=True, most=FARTHEST)
    return Pose(position, read_attitude(turn, f"{name}.orientation", can_be_nan=True))


def part(value: Any, name: str, key: str) -> Any:
    """Return a value of a map, None without one; an `InputError` if it is no map.

    Keys may be bytes, as those of old clients.
    """
    if not isinstance(value, Mapping):
        raise InputError(f"{name}={shown(value)} is not a map; give one with {key}")
    return value.get(key, value.get(key.encode()))


def read_path(value: Any, name: str = "path") -> list[list[float]]:
    """Return the points of a path, at least one; errors as of `read_map`."""
    if not isinstance(value, list | tuple) or not 0 < len(value) <= MAX_POINTS:
        raise InputError(f"{name} is not a list of 1 to {MAX_POINTS} points; give one")
    return [read_vector(point, name, most=FARTHEST) for point in value]


def read_drivetrain(value: Any, name: str) -> Drivetrain:
    """Return the drivetrain of 0 or 1."""
    is_forward = whole(value, name, 0, 1) == 1
    return Drivetrain.FORWARD_ONLY if is_forward else Drivetrain.MAX_DEGREE_OF_FREEDOM


def read_yaw_mode(value: Any, name: str) -> YawMode:
    """Return the yaw mode of a map; errors as of `read_map`."""
    is_rate = flag(part(value, name, "is_rate"), f"{name}.is_rate")
    (amount,) = read_map(value, name, ("yaw_or_rate",), most=MOST_TURN if is_rate else _LARGEST)
    return YawMode(is_rate, amount if is_rate else math.remainder(amount, 360.0))


def read_seconds(value: Any, name: str) -> float:
    """Return a timeout or duration within what pilots accept: clients send up to 3e38."""
    return min(max(number(value, name), 0.0), LONGEST)
