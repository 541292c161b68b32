import copy
import json

from benchmarks.tampered_inconsistent import INCONSISTENT, largest
from tests.benchmarks.test_tampering import CERTIFICATE


def test_changes_give_different_certificates():
    found = {}
    for name, change in INCONSISTENT.items():
        found[name] = json.dumps(change(copy.deepcopy(CERTIFICATE)))
    same = {name for name, text in found.items() if text == json.dumps(CERTIFICATE)}
    assert same == {"unfinished with nothing left"}  # a box is undecided
    texts = [text for name, text in found.items() if name not in same]
    assert len(set(texts)) == len(texts) >= 24


def test_changes_by_hand():
    changed = INCONSISTENT["boxes overlap by a hair"](copy.deepcopy(CERTIFICATE))
    assert changed["outcomes"][0]["boxes"] == [[[-6.0, -2.0 + 1e-12]], [[-2.0, 2.0]]]
    changed = INCONSISTENT["outcome split"](copy.deepcopy(CERTIFICATE))
    assert [o["boxes"] for o in changed["outcomes"]] == [[[[-6, -2]]], [[[3, 6]]], [[[-2, 2]]]]
    changed = INCONSISTENT["shares swapped"](copy.deepcopy(CERTIFICATE))
    assert [o["share"] for o in changed["outcomes"]] == [0.25, 2 / 3]
    complete = {"undecided": {"boxes": []}, "finished": True}
    assert INCONSISTENT["unfinished with nothing left"](complete)["finished"] is False


def test_the_largest_outcome():
    assert largest(CERTIFICATE["outcomes"])["end"] == "all_cubes"
