import copy
import json

import pytest

from benchmarks.tampered_consistent import CONSISTENT
from drone_rl.verification.checker.certificate import parse_certificate
from drone_rl.verification.checker.consistency import find_inconsistencies
from tests.benchmarks.test_tampering import CERTIFICATE


@pytest.mark.parametrize("name", CONSISTENT)
def test_a_changed_certificate_is_consistent(name):
    changed = CONSISTENT[name](copy.deepcopy(CERTIFICATE))
    assert json.dumps(changed) != json.dumps(CERTIFICATE)
    assert list(find_inconsistencies(parse_certificate(changed))) == []


def apply(name):
    changed = CONSISTENT[name](copy.deepcopy(CERTIFICATE))
    return {o["end"]: o for o in changed["outcomes"]}, changed


def test_changes_by_hand():
    outcomes, _ = apply("all won")
    assert list(outcomes) == ["all_cubes"]
    assert outcomes["all_cubes"]["boxes"] == [[[-6.0, 2.0]], [[3.0, 6.0]]]
    assert outcomes["all_cubes"]["share"] == 11 / 12
    outcomes, _ = apply("a border moved")
    assert outcomes["all_cubes"]["boxes"][1] == [[3.0, 3.003]]
    outcomes, changed = apply("undecided hidden")
    assert outcomes["front_boundary"]["boxes"][-1] == [[2.0, 3.0]]
    assert changed["undecided"] == {"share": 0.0, "boxes": []}
    outcomes, _ = apply("mirrored")
    assert outcomes["all_cubes"]["boxes"] == [[[-2.0, 6.0]]]
    outcomes, _ = apply("steps of one number")
    assert outcomes["all_cubes"]["steps"] == {"15": 0.65}
    outcomes, _ = apply("steps one fewer")
    assert outcomes["all_cubes"]["steps"] == {"13": 0.4, "14": 0.25}


def test_a_won_box_moves_to_a_new_outcome_if_all_are_won():
    won = copy.deepcopy(CERTIFICATE)
    won["outcomes"] = [{**won["outcomes"][0], "share": 1.0, "boxes": [[[-6.0, 6.0]]]}]
    won["undecided"] = {"share": 0.0, "boxes": []}
    changed = CONSISTENT["a won box lost"](copy.deepcopy(won))
    assert [(o["end"], o["share"]) for o in changed["outcomes"]] == [("front_boundary", 1.0)]
    for name in ("boxes exchanged", "a lost box won", "a border moved", "undecided hidden"):
        assert CONSISTENT[name](copy.deepcopy(won)) == won, name
