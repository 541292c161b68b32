import copy
import json

from benchmarks.tampered_inconsistent import PARTS, largest
from tests.benchmarks.test_tampering import CERTIFICATE


def test_every_way_changes_something_and_no_two_alike():
    found = {}
    for name, way in PARTS.items():
        found[name] = json.dumps(way(copy.deepcopy(CERTIFICATE)))
    same = {name for name, text in found.items() if text == json.dumps(CERTIFICATE)}
    assert same == {"unfinished with nothing left"}  # something is left
    texts = [text for name, text in found.items() if name not in same]
    assert len(set(texts)) == len(texts) >= 24


def test_by_hand():
    lied = PARTS["boxes overlap by a hair"](copy.deepcopy(CERTIFICATE))
    assert lied["outcomes"][0]["boxes"] == [[[-6.0, -2.0 + 1e-12]], [[-2.0, 2.0]]]
    lied = PARTS["outcome split"](copy.deepcopy(CERTIFICATE))
    assert [o["boxes"] for o in lied["outcomes"]] == [[[[-6, -2]]], [[[3, 6]]], [[[-2, 2]]]]
    lied = PARTS["shares swapped"](copy.deepcopy(CERTIFICATE))
    assert [o["share"] for o in lied["outcomes"]] == [0.25, 2 / 3]
    lied = PARTS["unfinished with nothing left"]({"undecided": {"boxes": []}, "finished": True})
    assert lied["finished"] is False


def test_the_largest_outcome():
    assert largest(CERTIFICATE["outcomes"])["end"] == "all_cubes"
