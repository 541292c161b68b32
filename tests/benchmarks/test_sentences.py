import importlib
import pkgutil
from collections.abc import Sequence

import pytest

import drone_rl
from benchmarks.evidence import changed
from benchmarks.sentences import (
    CHANGES,
    NO_CLAIMS,
    SENTENCES,
    EvidenceChange,
    bench_sentences,
    sentence_names,
)
from drone_rl.utils.text import Sentence


@pytest.mark.parametrize(
    "change", CHANGES, ids=lambda c: f"{c.subject}: {c.name}: {sorted(c.change)}"
)
def test_a_false_sentence_disappears_or_changes(change):
    before, after = change.texts
    assert before is not None, "the sentence must appear before the change"
    assert after != before


def test_every_sentence_with_a_claim_has_a_change():
    known = {(subject, name) for subject, (p, _) in SENTENCES.items() for name in sentence_names(p)}
    changed_ones = {(change.subject, change.name) for change in CHANGES}
    assert changed_ones <= known
    assert {name for _, name in known - changed_ones} == NO_CLAIMS


def test_names_of_sentences_are_unique():
    for paragraphs, _ in SENTENCES.values():
        names = sentence_names(paragraphs)
        assert len(set(names)) == len(names)


def test_every_sentence_of_the_package_is_registered():
    paragraphs = [p for given, _ in SENTENCES.values() for p in given]
    known = {id(s) for p in paragraphs for s in (p if isinstance(p, Sequence) else [p])}
    for module in pkgutil.walk_packages(drone_rl.__path__, "drone_rl."):
        for name, value in vars(importlib.import_module(module.name)).items():
            found = value if isinstance(value, tuple) else (value,)
            assert all(id(s) in known for s in found if isinstance(s, Sentence)), module.name
            is_paragraph = getattr(value, "__name__", "").startswith("say_")
            assert not is_paragraph or id(value) in known, name


def test_a_sentence_that_stays_or_never_appears_is_not_flipped():
    stays = EvidenceChange("explanation", "loops.share", {"dataset.frames": 7})
    assert not stays.is_flipped
    absent = EvidenceChange("explanation", "advice.use", {"loops.longest": 7})
    assert not absent.is_flipped


def test_all_sentences_are_flipped():
    found = bench_sentences()
    assert found["sentences_flipped"] == found["sentences_total"] >= 40


def test_changed_replaces_values_by_path_in_a_copy():
    evidence = {"a": {"b": [1, {"c": 2}]}}
    assert changed(evidence, {"a.b.1.c": 3, "d": 4}) == {"a": {"b": [1, {"c": 3}]}, "d": 4}
    assert evidence == {"a": {"b": [1, {"c": 2}]}}
