"""What may be said below each figure of a sweep, with what is needed for it and without."""

import copy

import pytest

from drone_rl.sweeps import text
from drone_rl.utils.text import said
from tests.evidence import SWEEP

PARTS = ("curves.", "shares.", "sides.", "entropies.", "costs.")
SENTENCES = [sentence for sentence in text.SENTENCES if sentence.name.startswith(PARTS)]


def speak(change=lambda summary: None):
    summary = copy.deepcopy(SWEEP)
    change(summary)
    return said(SENTENCES, summary)


def each(of, **values):
    """Changes every run or every group."""

    def change(summary):
        for entry in summary[of]:
            entry.update(values)

    return change


def test_a_sweep_with_something_of_everything_says_everything():
    assert set(speak()) == {sentence.name for sentence in SENTENCES}
    assert "all 8 runs that ended" in speak()["shares.bars"]
    assert speak()["sides.lost_left"] == "1 run one-sided to the right."
    assert speak()["sides.lost_right"] == "1 run one-sided to the left."


@pytest.mark.parametrize(
    ("change", "gone"),
    [
        (each("groups", ended=5, damaged=0), {"curves.band"}),
        (each("groups", ended=6, damaged=0), {"curves.runs"}),
        (lambda s: s.update(finished=0, failed=2), {"curves.ends", "costs.open"}),
        (lambda s: s.update(failed=0), {"curves.failed"}),
        (lambda s: s.update(judged=1), {"sides.dots"}),
        (each("runs", verdict="good"), {"sides.lost_left", "sides.lost_right"}),
        (lambda s: s.update(sides_not_offered=0), {"sides.not_offered"}),
        (each("runs", entropy=None), {"entropies.dots", "entropies.still"}),
        (each("runs", entropy=0.02), {"entropies.still"}),
        (each("groups", solved={"successes": 0}), {"costs.dots"}),
    ],
)
def test_what_is_not_there_is_not_told(change, gone):
    assert set(speak()) - set(speak(change)) == gone
