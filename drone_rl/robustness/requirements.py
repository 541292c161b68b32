"""Read a required operating domain: a range for each of some axes, in physical units."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from drone_rl.robustness.axes import AXES
from drone_rl.robustness.shifts_text import is_tested
from drone_rl.utils.errors import InputError
from drone_rl.utils.files import parse_json, read_bytes
from drone_rl.utils.limits import YAML_BYTES
from drone_rl.utils.readers import parse_yaml
from drone_rl.utils.schema import Maybe, Real, as_mapping, shown

_KEYS = ("low", "high", "unit")
_LIMIT = Maybe(Real(-1e9, 1e9))

_SIGNED = frozenset({"sun"})
"""Axes with values below 0."""

Need = Mapping[str, float | None]
"""Of an axis, "low" and "high"; None for the value without perturbation."""


def read_requirements(path: Path) -> dict[str, Need]:
    """Read requirements from a YAML or JSON file.

    The file has for each axis `{low: 40, high: 100, unit: m of sight}`; one end may be missing.

    Raises:
        InputError: The file is missing or damaged, an axis does not exist, a unit is not its own,
            or a range is none.
    """
    where = f"require_domain={path}"
    try:
        given = as_mapping(_parsed(path), "the file")
        if not given:
            raise InputError(
                "the file is empty; give axes, as in {fog: {low: 60, unit: m of sight}}"
            )
        return {name: _read_need(name, need) for name, need in given.items()}
    except InputError as error:
        raise InputError(f"{where}: {error}") from None


def ranges_of(numbers: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Return an operating domain, as in `shifts.json`, in the form of requirements."""
    return {
        name: {end: found[end] for end in ("low", "high") if found[end] is not None}
        | {"unit": AXES[name].unit}
        for name, found in numbers["domain"]["ranges"].items()
        if found["positions"] is not None and is_tested(numbers, name)
    }


def _parsed(path: Path) -> Any:
    content = read_bytes(path, YAML_BYTES)
    if path.suffix == ".json":
        return parse_json(content, "the file")
    return parse_yaml(content, "the file")


def _read_need(name: str, value: Any) -> Need:
    if name not in AXES:
        raise InputError(f"{shown(name)} is no axis; give some of: {', '.join(AXES)}")
    axis = AXES[name]
    example = f"give low, high or both, and unit: {axis.unit}"
    given = as_mapping(value, name)
    unknown = [key for key in given if key not in _KEYS]
    if unknown:
        raise InputError(f"{name}.{shown(unknown[0])} is unknown; {example}")
    if given.get("unit") != axis.unit:
        raise InputError(f"{name}.unit={shown(given.get('unit'))} is not its own; {example}")
    low, high = (_LIMIT.read(given.get(end), f"{name}.{end}") for end in ("low", "high"))
    if low is None and high is None:
        raise InputError(f"{name} has neither low nor high; {example}")
    if low is not None and high is not None and low > high:
        raise InputError(
            f"{name} goes from {low:g} to {high:g}, which is less; give the lower first"
        )
    least = min(end for end in (low, high) if end is not None)
    if least < 0 and name not in _SIGNED:
        raise InputError(
            f"{name} has {least:g}, and there is nothing below 0; give how much, whichever way"
        )
    return {"low": low, "high": high}
