"""Changes that make a certificate false but keep it consistent; only episodes refute it."""

import copy
import operator
from collections.abc import Callable, Mapping
from fractions import Fraction

import numpy as np

from benchmarks.tampered_inconsistent import Change, Data, largest
from drone_rl.policies.policy import load_policy
from drone_rl.policies.zoo import fingerprint
from drone_rl.verification.checker.consistency import MAX_MISSING, volume

_TAIL = 1000
"""Length of a box divided by the length of the part that moves to another outcome."""


def _updated(move_boxes: Callable[[Data], None]) -> Change:
    """Update shares and steps after boxes have moved, and remove empty outcomes."""

    def change(data: Data) -> Data:
        before = copy.deepcopy(data)
        move_boxes(data)
        if data == before:  # the change does not apply to this certificate
            return data
        task = data["policy"]["description"]["task"]
        placements = Fraction(2 * task["lateral_bound"]) ** task["num_cubes"]
        for part in (*data["outcomes"], data["undecided"]):
            boxes = np.array(part["boxes"]).reshape(-1, task["num_cubes"], 2)
            part["share"] = float(volume(boxes) / placements)
        usual = [steps for outcome in before["outcomes"] for steps in outcome["steps"].items()]
        for outcome in data["outcomes"]:
            total = sum(outcome["steps"].values())
            if not (1 - MAX_MISSING) * outcome["share"] < total <= outcome["share"]:
                outcome["steps"] = _scaled(outcome["steps"] or dict(usual), outcome["share"])
        data["outcomes"] = [outcome for outcome in data["outcomes"] if outcome["boxes"]]
        return data

    return change


def _scaled(steps: Mapping[str, float], share: float) -> dict[str, float]:
    """Scale the fractions of numbers of steps so that their sum is almost a share."""
    factor = (1 - MAX_MISSING / 2) * share / (sum(steps.values()) or 1.0)
    return {number: factor * one for number, one in steps.items()}


def _two(data: Data) -> list[Data]:
    """Return the two largest outcomes, or an empty list if there is only one."""
    ordered = sorted(data["outcomes"], key=lambda outcome: -outcome["share"])
    return ordered[:2] if len(ordered) > 1 else []


def _won(data: Data) -> Data:
    """Return the outcome in which all cubes are collected; add it if missing."""
    return _outcome(data, "all_cubes", True)


def _lost(data: Data) -> Data:
    """Return an outcome in which no cube is collected; add it if missing."""
    return _outcome(data, "front_boundary", False)


def _outcome(data: Data, end: str, collected: bool) -> Data:
    cubes = [collected] * data["policy"]["description"]["task"]["num_cubes"]
    for outcome in data["outcomes"]:
        if (outcome["end"], outcome["collected"]) == (end, cubes):
            return outcome
    new = {"end": end, "collected": cubes, "loops": False, "share": 0.0, "steps": {}, "boxes": []}
    data["outcomes"].append(new)
    return new


def _pop_largest(outcome: Data) -> list[list[float]]:
    """Remove and return the largest box of an outcome."""
    sizes = [float(np.prod(np.diff(box))) for box in outcome["boxes"]]
    return outcome["boxes"].pop(int(np.argmax(sizes)))


def _boxes_exchanged(data: Data) -> None:
    for one, other in [_two(data)] if _two(data) else []:
        one["boxes"], other["boxes"] = other["boxes"], one["boxes"]


def _lost_box_won(data: Data) -> None:
    lost = [outcome for outcome in data["outcomes"] if outcome["end"] != "all_cubes"]
    if lost:
        _won(data)["boxes"].append(_pop_largest(largest(lost)))


def _won_box_lost(data: Data) -> None:
    won = [outcome for outcome in data["outcomes"] if outcome["end"] == "all_cubes"]
    if won:
        _lost(data)["boxes"].append(_pop_largest(won[0]))


def _all_won(data: Data) -> None:
    won = _won(data)
    for outcome in data["outcomes"]:
        if outcome is not won:
            won["boxes"] += outcome["boxes"]
            outcome["boxes"] = []


def _border_moved(data: Data) -> None:
    """Move a slice of the largest box of one outcome to another."""
    for one, other in [_two(data)] if _two(data) else []:
        (low, high), *others = _pop_largest(other)
        cut = low + (high - low) / _TAIL
        one["boxes"].append([[low, cut], *others])
        other["boxes"].append([[cut, high], *others])


def _undecided_hidden(data: Data) -> None:
    """Move undecided boxes to the opposite of the most frequent outcome."""
    target = _lost if largest(data["outcomes"])["end"] == "all_cubes" else _won
    if hidden := data["undecided"]["boxes"]:
        target(data)["boxes"] += hidden
        data["undecided"]["boxes"] = []


def _another_boundary(data: Data) -> Data:
    """Exchange the front boundary and the side boundary."""
    ends = {"front_boundary": "side_boundary", "side_boundary": "front_boundary"}
    for outcome in data["outcomes"]:
        outcome["end"] = ends.get(outcome["end"], outcome["end"])
    return data


def _mirrored(data: Data) -> Data:
    """Reverse the order of the cubes and exchange left and right."""
    for part in (*data["outcomes"], data["undecided"]):
        part["boxes"] = [[[-b, -a] for a, b in reversed(box)] for box in part["boxes"]]
        part.get("collected", []).reverse()
    return data


def _another_policy(data: Data) -> Data:
    """Replace name and hash by those of another policy."""
    name = "good" if data["policy"]["name"] == "poor" else "poor"
    weights = fingerprint(load_policy(name).state["policy"])
    return {**data, "policy": {**data["policy"], "name": name, "weights": weights}}


def _farther(data: Data) -> Data:
    """Increase the distance of the first cube; false if episodes reach all cubes."""
    if any(o["end"] == "all_cubes" and o["steps"] for o in data["outcomes"]):
        data["policy"]["description"]["task"]["first_distance"] += 5.0
    return data


def _steps(new_steps: Callable[[dict[str, float]], dict[str, float]]) -> Change:
    def change(data: Data) -> Data:
        outcome = largest(data["outcomes"])
        outcome["steps"] = new_steps(outcome["steps"])
        return data

    return change


def _of_one_number(steps: dict[str, float]) -> dict[str, float]:
    """State the rarest number of steps for all episodes."""
    return {min(steps, key=steps.__getitem__): sum(steps.values())} if steps else steps


def _forgotten(steps: dict[str, float]) -> dict[str, float]:
    """Replace the most frequent number of steps by a number that is larger by 100."""
    if not steps:
        return steps
    most, share = max(steps.items(), key=operator.itemgetter(1))
    others = {name: one for name, one in steps.items() if name != most}
    return {**others, str(int(most) + 100): share}


CONSISTENT: dict[str, Change] = {
    "boxes exchanged": _updated(_boxes_exchanged),
    "a lost box won": _updated(_lost_box_won),
    "a won box lost": _updated(_won_box_lost),
    "all won": _updated(_all_won),
    "a border moved": _updated(_border_moved),
    "undecided hidden": _updated(_undecided_hidden),
    "another boundary": _another_boundary,
    "mirrored": _mirrored,
    "another policy": _another_policy,
    "farther away": _farther,
    "steps one fewer": _steps(lambda steps: {str(int(n) - 1): s for n, s in steps.items()}),
    "steps of one number": _steps(_of_one_number),
    "steps of another number": _steps(_forgotten),
}
"""Changes by name."""
