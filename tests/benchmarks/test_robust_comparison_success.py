"""Success rates of policies under the same conditions, by hand."""

import dataclasses

import pytest

from benchmarks.robust_comparison import PLAIN, by_kind, compare, mean
from drone_rl.config import TaskSettings
from drone_rl.trust.axes import AXES
from drone_rl.trust.paired_evaluation import PairedEvaluator
from tests.trust.subjects import Blind, Steering, subject

AHEAD = TaskSettings(num_cubes=1, first_distance=8.0, front_margin=4.0, lateral_bound=0.0)


@pytest.fixture
def evaluator():
    made = PairedEvaluator(subject(Blind(0), task=AHEAD), 3)
    yield made
    made.close()


def test_blind_policies_are_not_affected_by_blur(evaluator):
    """Flying straight always succeeds in this task, flying left never does."""
    subjects = {"ahead": evaluator.subject, "left": subject(Blind(1), task=AHEAD)}
    found = compare(evaluator, subjects, [AXES["blur"], AXES["object_size"]])
    assert found["ahead"] == {PLAIN: 1.0, "blur": 1.0, "object_size": 1.0}
    assert found["left"] == {PLAIN: 0.0, "blur": 0.0, "object_size": 0.0}


def test_impossible_strengths_are_left_out_for_all(evaluator):
    """All rows are dead, so even the oracle, which knows visible cubes only, finds no cube."""
    dark = dataclasses.replace(AXES["dead_rows"], strengths=(5.0,) * 5)
    aside = AHEAD.replace(lateral_bound=6.0)
    field = PairedEvaluator(subject(Steering(), task=aside), 12)
    try:
        found = compare(field, {"one": field.subject}, [dark])
    finally:
        field.close()
    assert set(found["one"]) == {PLAIN}
    half = dataclasses.replace(dark, strengths=(5.0, 5.0, 5.0, 5.0, 0.0))
    assert compare(evaluator, {"one": evaluator.subject}, [half])["one"]["dead_rows"] == 1.0


def test_means_by_kind_of_shift_by_hand():
    shares = {PLAIN: 1.0, "sun": 0.5, "brightness": 1.0, "fog": 0.25}
    assert by_kind(shares, ["light", "fog", "sensor"]) == {"light": 0.75, "fog": 0.25}
    assert mean([0.5, 1.0]) == 0.75
