import copy
import json

import pytest

from benchmarks.tampered_consistent import WHOLES
from drone_rl.verification.checker.certificate import parse_certificate
from drone_rl.verification.checker.consistency import find_inconsistencies
from tests.benchmarks.test_tampering import CERTIFICATE


@pytest.mark.parametrize("name", WHOLES)
def test_each_goes_together_so_that_only_flights_tell(name):
    lied = WHOLES[name](copy.deepcopy(CERTIFICATE))
    assert json.dumps(lied) != json.dumps(CERTIFICATE)
    assert list(find_inconsistencies(parse_certificate(lied))) == []


def lied(name):
    made = WHOLES[name](copy.deepcopy(CERTIFICATE))
    return {o["end"]: o for o in made["outcomes"]}, made


def test_by_hand():
    outcomes, _ = lied("all won")
    assert list(outcomes) == ["all_cubes"]
    assert outcomes["all_cubes"]["boxes"] == [[[-6.0, 2.0]], [[3.0, 6.0]]]
    assert outcomes["all_cubes"]["share"] == 11 / 12
    outcomes, _ = lied("a border moved")
    assert outcomes["all_cubes"]["boxes"][1] == [[3.0, 3.003]]
    outcomes, made = lied("undecided hidden")
    assert outcomes["front_boundary"]["boxes"][-1] == [[2.0, 3.0]]
    assert made["undecided"] == {"share": 0.0, "boxes": []}
    outcomes, _ = lied("mirrored")
    assert outcomes["all_cubes"]["boxes"] == [[[-2.0, 6.0]]]
    outcomes, _ = lied("steps of one number")
    assert outcomes["all_cubes"]["steps"] == {"15": 0.65}
    outcomes, _ = lied("steps one fewer")
    assert outcomes["all_cubes"]["steps"] == {"13": 0.4, "14": 0.25}


def test_what_is_all_won_is_lost_in_an_outcome_of_its_own():
    won = copy.deepcopy(CERTIFICATE)
    won["outcomes"] = [{**won["outcomes"][0], "share": 1.0, "boxes": [[[-6.0, 6.0]]]}]
    won["undecided"] = {"share": 0.0, "boxes": []}
    made = WHOLES["a won box lost"](copy.deepcopy(won))
    assert [(o["end"], o["share"]) for o in made["outcomes"]] == [("front_boundary", 1.0)]
    for name in ("boxes exchanged", "a lost box won", "a border moved", "undecided hidden"):
        assert WHOLES[name](copy.deepcopy(won)) == won, name
