import importlib
import pkgutil

import pytest

import drone_rl
from benchmarks.evidence import changed
from benchmarks.sentences import NO_CLAIMS, PLANTS, SPOKEN, Plant, bench_sentences
from drone_rl.utils.text import Sentence


@pytest.mark.parametrize("plant", PLANTS, ids=lambda p: f"{p.of}: {p.name}: {sorted(p.lie)}")
def test_a_false_sentence_goes_or_changes(plant):
    before, after = plant.said
    assert before is not None, "the sentence must be said before"
    assert after != before


def test_no_sentence_is_without_a_plant():
    spoken = {(of, s.name) for of, (sentences, _) in SPOKEN.items() for s in sentences}
    planted = {(plant.of, plant.name) for plant in PLANTS}
    assert planted <= spoken
    assert {name for _, name in spoken - planted} == NO_CLAIMS


def test_names_are_told_apart():
    for sentences, _ in SPOKEN.values():
        names = [s.name for s in sentences]
        assert len(set(names)) == len(names)


def test_every_sentence_of_the_package_is_spoken():
    spoken = {id(s) for sentences, _ in SPOKEN.values() for s in sentences}
    for module in pkgutil.walk_packages(drone_rl.__path__, "drone_rl."):
        for value in vars(importlib.import_module(module.name)).values():
            found = value if isinstance(value, tuple) else (value,)
            assert all(id(s) in spoken for s in found if isinstance(s, Sentence)), module.name


def test_a_sentence_that_stays_is_not_counted_as_flipped():
    stays = Plant("explanation", "loops.some", {"dataset.frames": 7})
    assert not stays.is_flipped
    never_said = Plant("explanation", "loops.none", {"loops.longest": 7})
    assert not never_said.is_flipped


def test_the_figures():
    found = bench_sentences()
    assert found["sentences_flipped"] == found["sentences_total"] >= 40


def test_changes_go_to_their_place_and_leave_the_evidence_alone():
    evidence = {"a": {"b": [1, {"c": 2}]}}
    assert changed(evidence, {"a.b.1.c": 3, "d": 4}) == {"a": {"b": [1, {"c": 3}]}, "d": 4}
    assert evidence == {"a": {"b": [1, {"c": 2}]}}
