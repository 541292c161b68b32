"""Tampered certificates: files that are cut, contradict themselves, or state something false."""

import copy
import json

import drone_rl
from drone_rl.policies.zoo import fingerprint


def _largest(data):
    return max(data["outcomes"], key=lambda outcome: outcome["share"])


def _all_won(data):
    """State success from every decided placement, with the most frequent steps scaled to it."""
    decided = sum(outcome["share"] for outcome in data["outcomes"])
    largest = _largest(data)
    steps = {n: share * decided / largest["share"] for n, share in largest["steps"].items()}
    boxes = [box for outcome in data["outcomes"] for box in outcome["boxes"]]
    won = {"end": "all_cubes", "collected": [True] * len(largest["collected"]), "loops": False}
    data["outcomes"] = [{**won, "share": decided, "steps": steps, "boxes": boxes}]


def _mirrored(data):
    for part in (*data["outcomes"], data["undecided"]):
        part["boxes"] = [[[-high, -low] for low, high in box] for box in part["boxes"]]


def _of_another_policy(data):
    data["policy"]["weights"] = fingerprint(drone_rl.load_policy("good").state.weights)


def _farther(data):
    data["policy"]["description"]["task"]["parameters"]["first_distance"] += 5.0


def _other_steps(data):
    outcome = _largest(data)
    outcome["steps"] = {str(int(number) + 1): share for number, share in outcome["steps"].items()}


CHANGES = {
    "share higher": lambda data: _largest(data).update(share=0.99),
    "share not a number": lambda data: _largest(data).update(share=float("nan")),
    "box dropped": lambda data: _largest(data)["boxes"].pop(),
    "box twice": lambda data: _largest(data)["boxes"].append(_largest(data)["boxes"][0]),
    "unknown end": lambda data: _largest(data).update(end="landed"),
    "all won": _all_won,
    "mirrored": _mirrored,
    "another policy": _of_another_policy,
    "farther away": _farther,
    "other steps": _other_steps,
}
BYTES = {
    "cut in half": lambda text: text[: len(text) // 2],
    "too deep": lambda text: text[:-1] + b', "more": ' + b"[" * 10**5 + b"]" * 10**5 + b"}",
}


def tampered(certificate):
    """Return the content of each tampered file of a certificate by name."""
    valid = json.dumps(certificate).encode()
    files = {name: change(valid) for name, change in BYTES.items()}
    for name, change in CHANGES.items():
        data = copy.deepcopy(certificate)
        change(data)
        files[name] = json.dumps(data).encode()
    return files
