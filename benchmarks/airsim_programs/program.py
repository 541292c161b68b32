"""The table of programs, and the comparison of measured with right numbers."""

import math
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

VERSIONS = ("AirSimClient", "airsim-1.2", "airsim", "cosysairsim")
"""Clients 1.1, 1.2, 1.8 and Cosys 3.5: modules, the second one with its version."""


class Near(NamedTuple):
    """A right number, or a nested list of them, and the largest difference."""

    value: Any
    tolerance: float


class Program(NamedTuple):
    """A program, the server that it needs, and its right numbers."""

    run: Callable[[Any], Mapping[str, Any]]
    """Takes a `Session` and returns measured numbers by name."""
    right: Mapping[str, Any]
    """By name: a `Near`, or an equal value; a dict of them by version, where they differ."""
    clients: tuple[str, ...]
    """Those that have its calls, of `VERSIONS`."""
    settings: str
    """Content of settings.json; FOLDER stands for a new folder."""
    options: Mapping[str, Any]
    """Further arguments of `drone_rl.serve`."""


PROGRAMS: dict[str, Program] = {}
"""By name."""


def program(
    label: str = "",
    *,
    since: str = VERSIONS[0],
    until: str = VERSIONS[-1],
    settings: str = "{}",
    options: Mapping[str, Any] | None = None,
    **right: Any,
) -> Callable[[Callable[[Any], Mapping[str, Any]]], Callable[[Any], Mapping[str, Any]]]:
    """Enter a function into `PROGRAMS`.

    Args:
        label: Its name; that of the function by default.
        since: First of `VERSIONS` that has its calls.
        until: Last one.
        settings: See `Program`.
        options: See `Program`.
        right: See `Program`.
    """
    clients = VERSIONS[VERSIONS.index(since) : VERSIONS.index(until) + 1]

    def enter(run: Callable[[Any], Mapping[str, Any]]) -> Callable[[Any], Mapping[str, Any]]:
        PROGRAMS[label or run.__name__] = Program(run, right, clients, settings, options or {})
        return run

    return enter


def mistakes(one: Program, version: str, measured: Mapping[str, Any]) -> list[str]:
    """Return the measured numbers that are not right, each as a line."""
    lines = [f"{name} is not checked" for name in measured if name not in one.right]
    for name, right in one.right.items():
        wanted = right[version] if isinstance(right, dict) else right
        if not _agrees(measured.get(name), wanted):
            lines.append(f"{name}: {measured.get(name)}, right is {wanted}")
    return lines


def _agrees(value: Any, right: Any) -> bool:
    if not isinstance(right, Near):
        return bool(value == right)
    if isinstance(right.value, list | tuple):
        return (
            isinstance(value, list)
            and len(value) == len(right.value)
            and all(
                _agrees(a, Near(b, right.tolerance))
                for a, b in zip(value, right.value, strict=True)
            )
        )
    is_number = isinstance(value, int | float) and math.isfinite(value)
    return is_number and abs(value - right.value) <= right.tolerance
