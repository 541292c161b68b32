"""Changes that make a certificate inconsistent, or a certificate of another policy or task."""

import copy
from collections.abc import Callable
from typing import Any

Data = dict[str, Any]
"""Content of a certificate."""
Change = Callable[[Data], Data]
"""Return a changed certificate; the argument may be modified."""


def largest(outcomes: list[Data]) -> Data:
    """Return the outcome with the largest share."""
    return max(outcomes, key=lambda outcome: outcome["share"])


def _part(*keys: str, to: Any) -> Change:
    """Replace a value by another, or by the result of a function."""

    def change(data: Data) -> Data:
        part: Any = data
        for key in keys[:-1]:
            part = part[key]
        part[keys[-1]] = to(part[keys[-1]]) if callable(to) else to
        return data

    return change


def _described(*keys: str, to: Any) -> Change:
    return _part("policy", "description", *keys, to=to)


def _outcome(*keys: str, to: Any) -> Change:
    """Replace a value in the largest outcome."""

    def change(data: Data) -> Data:
        _part(*keys, to=to)(largest(data["outcomes"]))
        return data

    return change


def _boxes(change: Callable[[list[Any]], list[Any]]) -> Change:
    """Replace the first box of the largest outcome by other boxes."""
    return _outcome("boxes", to=lambda boxes: [*change(boxes[0]), *boxes[1:]])


def _first_side(change: Callable[[float, float], list[Any]]) -> Change:
    """Replace the first interval of this box."""
    return _boxes(lambda box: [[change(*box[0]), *box[1:]]])


def _overlapping(box: list[Any]) -> list[Any]:
    (low, high), *others = box
    middle = (low + high) / 2
    return [[[low, middle + 1e-12], *others], [[middle, high], *others]]


def _swapped_shares(data: Data) -> Data:
    if len(data["outcomes"]) > 1:
        one, other = data["outcomes"][:2]
        one["share"], other["share"] = other["share"], one["share"]
    return data


def _twice(data: Data) -> Data:
    return {**data, "outcomes": [*data["outcomes"], copy.deepcopy(largest(data["outcomes"]))]}


def _split(data: Data) -> Data:
    """Split an outcome into two, each with half of every box."""
    first = largest(data["outcomes"])
    first["share"] /= 2
    first["steps"] = {number: share / 2 for number, share in first["steps"].items()}
    second = copy.deepcopy(first)
    for low, high in zip(first["boxes"], second["boxes"], strict=True):
        middle = (low[0][0] + low[0][1]) / 2
        low[0][1] = high[0][0] = middle
    return {**data, "outcomes": [*data["outcomes"], second]}


def _dropped_outcome(data: Data) -> Data:
    return {**data, "outcomes": [o for o in data["outcomes"] if o is not largest(data["outcomes"])]}


def _unfinished(data: Data) -> Data:
    """State "unfinished" if nothing is undecided; a false "finished" is not visible in the file."""
    return data if data["undecided"]["boxes"] else {**data, "finished": False}


INCONSISTENT: dict[str, Change] = {
    "share higher": _outcome("share", to=lambda share: min(1.0, share + 1e-9) - (share == 1) / 9),
    "share below zero": _outcome("share", to=-0.1),
    "share not a number": _outcome("share", to=float("nan")),
    "share a truth value": _outcome("share", to=True),
    "shares swapped": _swapped_shares,
    "box larger": _first_side(lambda low, high: [low - 1e-3, high + 1e-3]),
    "box smaller": _first_side(lambda low, high: [low, high - (high - low) * 1e-6]),
    "box turned inside out": _first_side(lambda low, high: [high, low]),
    "box without width": _first_side(lambda low, high: [low, low]),
    "border not a number": _first_side(lambda low, high: [float("nan"), high]),
    "border infinite": _first_side(lambda low, high: [float("-inf"), high]),
    "border a text": _first_side(lambda low, high: [str(low), high]),
    "three borders": _first_side(lambda low, high: [low, (low + high) / 2, high]),
    "box dropped": _boxes(lambda box: []),
    "box twice": _boxes(lambda box: [box, box]),
    "boxes overlap by a hair": _boxes(_overlapping),
    "box of a cube more": _boxes(lambda box: [[*box, [-1.0, 1.0]]]),
    "outcome dropped": _dropped_outcome,
    "outcome twice": _twice,
    "outcome split": _split,
    "other cubes collected": _outcome("collected", to=lambda every: [not one for one in every]),
    "loops or not": _outcome("loops", to=lambda loops: not loops),
    "unknown end": _outcome("end", to="landed"),
    "running for ever": _outcome("end", to="running"),
    "steps of more than its share": _outcome("steps", to=lambda steps: {"30": 1.0, **steps}),
    "no steps": _outcome("steps", to={}),
    "steps of next to nothing": _outcome("steps", to=lambda steps: dict.fromkeys(steps, 1e-12)),
    "steps beyond the limit": _outcome("steps", to={"99999": 1e-6}),
    "steps below zero": _outcome("steps", to={"-3": 1e-6}),
    "another claim": _outcome("certainly", to=True),
    "undecided share halved": _part("undecided", "share", to=lambda share: share / 2),
    "undecided share raised": _part("undecided", "share", to=lambda share: share + 1e-9),
    "unfinished with nothing left": _unfinished,
    "finished as a number": _part("finished", to=1),
    "hash changed": _part("policy", "weights", to=lambda text: text[::-1]),
    "camera wider": _described("camera", "width", to=lambda width: width + 1),
    "field of view wider": _described("camera", "horizontal_fov", to=lambda fov: fov + 1),
    "transform more": _described("transforms", to=lambda steps: [*steps, steps[-1]]),
    "another network": _described("network", "name", to="mlp"),
    "a cube more": _described("task", "num_cubes", to=lambda cubes: cubes + 1),
    "wider task": _described("task", "lateral_bound", to=lambda bound: bound * 1.5),
    "narrower task": _described("task", "lateral_bound", to=lambda bound: bound / 1.5),
    "cubes above and below": _described("task", "vertical_bound", to=0.5),
    "future version": _part("format_version", to=2),
    "another format": _part("format", to="drone_rl policy"),
}
"""Changes by name."""
