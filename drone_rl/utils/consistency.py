"""Consistency of rates, means and intervals in files.

A reader can't know whether the figures of a file were measured. But a rate and its exact interval
follow from its counts, and the interval of a mean has a least width for a number of values. So a
rate or mean that passes its check claims no more than its own counts allow. `where` names the
checked part in messages.
"""

import math
from collections.abc import Mapping
from typing import Any

from drone_rl.utils.errors import InputError
from drone_rl.utils.intervals import may_bound_mean, proportion
from drone_rl.utils.schema import Kind, Real, Whole, as_mapping, shown

MOST_VALUES = 10**9
"""Greatest count of one rate or mean."""
COUNT = Whole(0, MOST_VALUES)
_NUMBER = Real(-math.inf)
_ROUNDING = 1e-6
_COUNTS = ("episodes", "frames", "steps", "trials", "successes", "count", "goals", "pairs")
"""Entries that are counts where they are numbers."""


def check_intervals(given: Any, where: str) -> None:
    """Check all rates, means and counts in plain data.

    The width of a mean's interval depends on the values' bounds; see `check_mean`.

    Raises:
        InputError: A rate does not follow from its counts, a value is outside its interval, the
            interval of a rate is narrower than its counts allow, or a count is negative.
    """
    waiting = [(given, where)]
    while waiting:
        item, place = waiting.pop()
        if isinstance(item, list):
            waiting += [(value, place) for value in item if isinstance(value, list | Mapping)]
        if isinstance(item, Mapping):
            _check_entries(item, place)
            waiting += [(value, f"{place}.{name}"[:200]) for name, value in item.items()]


def _check_entries(given: Mapping[str, Any], where: str) -> None:
    """Check the counts of one mapping, and its rate or mean."""
    for name in _COUNTS:
        if isinstance(given.get(name), int | float):
            read_entry(given, name, COUNT, where)
    if {"successes", "trials", "share"} <= given.keys():
        check_proportion(given, where)
    elif {"lower95", "upper95"} <= given.keys():
        middle = given.get("mean", given.get("share"))
        if middle is not None:
            check_order(given, middle, where)


def check_proportion(given: Any, where: str, trials: int | None = None) -> int:
    """Check a rate and its interval from `utils.intervals.proportion`; return the successes.

    `trials` is the required number of trials; None for any.

    Raises:
        InputError: The rate or its interval does not follow from its counts.
    """
    given = as_mapping(given, where)
    successes, total = (read_entry(given, key, COUNT, where) for key in ("successes", "trials"))
    if successes > total:
        raise InputError(f"{where}: {successes} of {total} is no fraction; measure it again")
    if trials is not None:
        check_same(total, trials, f"{where}.trials")
    expected = proportion(successes, total)
    check_same(given.get("share"), expected["share"], f"{where}.share")
    if total:
        check_order(given, given["share"], where)
    check_width(given, expected, where)
    return successes


def check_mean(
    given: Any, where: str, bounds: tuple[float, float] = (0.0, 1.0), count: int | None = None
) -> float | None:
    """Check a mean and its interval from `utils.intervals.mean_bounds`; return the mean.

    `bounds` are the least and greatest possible value, `count` the required number of values.

    Raises:
        InputError: It is out of bounds, or its interval is narrower than the count allows.
    """
    given = as_mapping(given, where)
    number = read_entry(given, "count", COUNT, where)
    if count is not None:
        check_same(number, count, f"{where}.count")
    mean = given.get("mean")
    if (mean is None) != (number == 0):
        raise InputError(f"{where}.mean={shown(mean)} is of {number} values; measure it again")
    if mean is not None:
        mean = read_entry(given, "mean", Real(*bounds), where)
        check_order(given, mean, where)
    interval = tuple(read_entry(given, key, _NUMBER, where) for key in ("lower95", "upper95"))
    check_mean_width(interval, mean, number, bounds, 0.95, where)
    return mean


def check_order(given: Mapping[str, Any], value: float, where: str) -> None:
    """Raise an `InputError` unless "lower95" and "upper95" bound a value."""
    value = _NUMBER.read(value, where)
    lower, upper = (read_entry(given, key, _NUMBER, where) for key in ("lower95", "upper95"))
    if not lower - _ROUNDING <= value <= upper + _ROUNDING:
        raise InputError(
            f"{where}={value:g} is outside its interval, {lower:g} to {upper:g}; measure it again"
        )


def check_width(given: Mapping[str, Any], narrowest: Mapping[str, Any], where: str) -> None:
    """Raise an `InputError` if "lower95" and "upper95" are inside those of a valid interval."""
    lower, upper = (read_entry(given, key, _NUMBER, where) for key in ("lower95", "upper95"))
    if lower > narrowest["lower95"] + _ROUNDING or upper < narrowest["upper95"] - _ROUNDING:
        raise InputError(
            f"{where}: {lower:g} to {upper:g} is narrower than its counts allow; measure it again"
        )


def check_mean_width(
    interval: tuple[float, ...],
    mean: float | None,
    count: int,
    bounds: tuple[float, float],
    confidence: float,
    where: str,
) -> None:
    """Raise an `InputError` if the interval of a mean is narrower than any valid one.

    `mean` is None of no values, `bounds` the least and greatest possible value, `confidence` the
    coverage that the interval claims.
    """
    lower, upper = interval
    if mean is None:
        possible = (lower, upper) == bounds
    else:
        possible = may_bound_mean((lower, upper), mean, count, *bounds, confidence)
    if not possible:
        raise InputError(
            f"{where}: {lower:g} to {upper:g} is narrower than {count} values allow; measure it "
            "again"
        )


def check_same(given: Any, expected: float | None, where: str) -> None:
    """Raise an `InputError` unless a value of a file equals the expected one up to rounding."""
    if expected is None and given is None:
        return
    if (
        expected is None
        or type(given) not in (int, float)
        or not abs(given - expected) <= _ROUNDING * max(1.0, abs(expected))
    ):
        raise InputError(f"{where}={shown(given)} contradicts other figures (expected {expected})")


def read_entry(given: Mapping[str, Any], key: str, kind: Kind, where: str) -> Any:
    """Return an entry of a mapping; raise an `InputError` if it is missing or of another kind."""
    return kind.read(as_mapping(given, where).get(key), f"{where}.{key}")
