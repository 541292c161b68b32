"""Certificates that go together and are of this network and task, but false: only flights tell."""

import copy
import operator
from collections.abc import Callable, Mapping
from fractions import Fraction

import numpy as np

from benchmarks.tampered_inconsistent import Data, Way, largest
from drone_rl.policies.policy import load_policy
from drone_rl.verification.checker.certificate import fingerprint
from drone_rl.verification.checker.consistency import MOST_MISSING, volume

_TAIL = 1000
"""A box's length by that of the part that is given to another outcome."""


def _reshared(way: Callable[[Data], None]) -> Way:
    """Makes shares and steps those of the boxes afterwards, and leaves no outcome empty."""

    def whole(data: Data) -> Data:
        before = copy.deepcopy(data)
        way(data)
        if data == before:  # nothing there to lie about
            return data
        task = data["policy"]["description"]["task"]
        placements = Fraction(2 * task["lateral_bound"]) ** task["num_cubes"]
        for part in (*data["outcomes"], data["undecided"]):
            boxes = np.array(part["boxes"]).reshape(-1, task["num_cubes"], 2)
            part["share"] = float(volume(boxes) / placements)
        usual = [steps for outcome in before["outcomes"] for steps in outcome["steps"].items()]
        for outcome in data["outcomes"]:
            total = sum(outcome["steps"].values())
            if not (1 - MOST_MISSING) * outcome["share"] < total <= outcome["share"]:
                outcome["steps"] = _scaled(outcome["steps"] or dict(usual), outcome["share"])
        data["outcomes"] = [outcome for outcome in data["outcomes"] if outcome["boxes"]]
        return data

    return whole


def _scaled(steps: Mapping[str, float], share: float) -> dict[str, float]:
    """Numbers of steps as frequent as before, of nearly all of a share."""
    factor = (1 - MOST_MISSING / 2) * share / (sum(steps.values()) or 1.0)
    return {number: factor * one for number, one in steps.items()}


def _two(data: Data) -> list[Data]:
    """The two largest outcomes, if there are two."""
    ordered = sorted(data["outcomes"], key=lambda outcome: -outcome["share"])
    return ordered[:2] if len(ordered) > 1 else []


def _won(data: Data) -> Data:
    """The outcome in which all are collected, made if there is none."""
    return _outcome(data, "all_cubes", True)


def _lost(data: Data) -> Data:
    """One in which none is collected."""
    return _outcome(data, "front_boundary", False)


def _outcome(data: Data, end: str, collected: bool) -> Data:
    cubes = [collected] * data["policy"]["description"]["task"]["num_cubes"]
    for outcome in data["outcomes"]:
        if (outcome["end"], outcome["collected"]) == (end, cubes):
            return outcome
    made = {"end": end, "collected": cubes, "loops": False, "share": 0.0, "steps": {}, "boxes": []}
    data["outcomes"].append(made)
    return made


def _take_largest(outcome: Data) -> list[list[float]]:
    """The largest of its boxes, which it has no more."""
    sizes = [float(np.prod(np.diff(box))) for box in outcome["boxes"]]
    return outcome["boxes"].pop(int(np.argmax(sizes)))


def _boxes_exchanged(data: Data) -> None:
    for one, other in [_two(data)] if _two(data) else []:
        one["boxes"], other["boxes"] = other["boxes"], one["boxes"]


def _lost_box_won(data: Data) -> None:
    lost = [outcome for outcome in data["outcomes"] if outcome["end"] != "all_cubes"]
    if lost:
        _won(data)["boxes"].append(_take_largest(largest(lost)))


def _won_box_lost(data: Data) -> None:
    won = [outcome for outcome in data["outcomes"] if outcome["end"] == "all_cubes"]
    if won:
        _lost(data)["boxes"].append(_take_largest(won[0]))


def _all_won(data: Data) -> None:
    won = _won(data)
    for outcome in data["outcomes"]:
        if outcome is not won:
            won["boxes"] += outcome["boxes"]
            outcome["boxes"] = []


def _border_moved(data: Data) -> None:
    """One outcome has a slice of the largest box of another."""
    for one, other in [_two(data)] if _two(data) else []:
        (low, high), *others = _take_largest(other)
        cut = low + (high - low) / _TAIL
        one["boxes"].append([[low, cut], *others])
        other["boxes"].append([[cut, high], *others])


def _undecided_hidden(data: Data) -> None:
    """As lost where most is won, as won where most is lost; wrong at one side of each border."""
    to = _lost if largest(data["outcomes"])["end"] == "all_cubes" else _won
    if hidden := data["undecided"]["boxes"]:
        to(data)["boxes"] += hidden
        data["undecided"]["boxes"] = []


def _another_boundary(data: Data) -> Data:
    """Flights to the front boundary end at the side, and the other way round."""
    ends = {"front_boundary": "side_boundary", "side_boundary": "front_boundary"}
    for outcome in data["outcomes"]:
        outcome["end"] = ends.get(outcome["end"], outcome["end"])
    return data


def _mirrored(data: Data) -> Data:
    """The first cubes' places as if they were the last ones', and left as if it were right."""
    for part in (*data["outcomes"], data["undecided"]):
        part["boxes"] = [[[-b, -a] for a, b in reversed(box)] for box in part["boxes"]]
        part.get("collected", []).reverse()
    return data


def _another_policy(data: Data) -> Data:
    """The same of a network that is another one, with its hash."""
    name = "good" if data["policy"]["name"] == "poor" else "poor"
    weights = fingerprint(load_policy(name).state["policy"])
    return {**data, "policy": {**data["policy"], "name": name, "weights": weights}}


def _farther(data: Data) -> Data:
    """The same of a task in which all is farther away; a lie where flights get to all cubes."""
    if any(o["end"] == "all_cubes" and o["steps"] for o in data["outcomes"]):
        data["policy"]["description"]["task"]["first_distance"] += 5.0
    return data


def _steps(change: Callable[[dict[str, float]], dict[str, float]]) -> Way:
    def way(data: Data) -> Data:
        outcome = largest(data["outcomes"])
        outcome["steps"] = change(outcome["steps"])
        return data

    return way


def _of_one_number(steps: dict[str, float]) -> dict[str, float]:
    """All flights as long as the fewest are."""
    return {min(steps, key=steps.__getitem__): sum(steps.values())} if steps else steps


def _forgotten(steps: dict[str, float]) -> dict[str, float]:
    """The most frequent number of steps as if it were the next but one."""
    if not steps:
        return steps
    most, share = max(steps.items(), key=operator.itemgetter(1))
    others = {name: one for name, one in steps.items() if name != most}
    return {**others, str(int(most) + 100): share}


WHOLES: dict[str, Way] = {
    "boxes exchanged": _reshared(_boxes_exchanged),
    "a lost box won": _reshared(_lost_box_won),
    "a won box lost": _reshared(_won_box_lost),
    "all won": _reshared(_all_won),
    "a border moved": _reshared(_border_moved),
    "undecided hidden": _reshared(_undecided_hidden),
    "another boundary": _another_boundary,
    "mirrored": _mirrored,
    "another policy": _another_policy,
    "farther away": _farther,
    "steps one fewer": _steps(lambda steps: {str(int(n) - 1): s for n, s in steps.items()}),
    "steps of one number": _steps(_of_one_number),
    "steps of another number": _steps(_forgotten),
}
"""By name."""
