"""How near a drone in flight stays to its paths, and to its place in wind."""

import math
from typing import Any

from benchmarks.hover_error import HoverError, hover_error
from benchmarks.path_following import courses, path_following
from drone_rl.config import DynamicsSettings

WIND = 5.0
"""Metres a second in which drones hover."""
_DIRECTIONS = 8
"""From which it blows, one after the other."""


def bench_flight_paths(quick: bool) -> dict[str, Any]:
    """The pilot's commands on the default drone.

    Args:
        quick: Whether the square and one direction of wind will do.

    Returns:
        "path_error_m": mean distance from a square of 10 m at 2 m/s. "path_errors": of every course
        its length, speed, mean and greatest distance and seconds. "hover_error_m": mean distance
        from its place of a drone that hovers in wind of 5 m/s, once it has been blown there, from
        the worst direction; "hover_greatest_m": the greatest on the way there.
    """
    chosen = {"square": courses()["square"]} if quick else courses()
    followed = path_following(chosen)
    errors = [_blown(number) for number in range(1 if quick else _DIRECTIONS)]
    return {
        "path_error_m": followed["square"].mean,
        "path_errors": {name: vars(following) for name, following in followed.items()},
        "hover_error_m": max(error.mean for error in errors),
        "hover_greatest_m": max(error.greatest for error in errors),
    }


def _blown(number: int) -> HoverError:
    angle = 2.0 * math.pi * number / _DIRECTIONS
    wind = (WIND * math.cos(angle), WIND * math.sin(angle), 0.0)
    return hover_error(DynamicsSettings(mode="simple_flight", wind=wind), num_drones=1)
