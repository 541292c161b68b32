import pytest

from drone_rl.utils.text import Sentence, percent, said, say

MANY = Sentence("loops.many", "a loop", lambda e: e["loops"] > 0, lambda e: f"{e['loops']} loops.")
NONE = Sentence("loops.never", "none", lambda e: e["loops"] == 0, lambda e: "No loop.")


def test_only_what_the_evidence_allows_is_said():
    assert say([MANY, NONE], {"loops": 3}) == "3 loops."
    assert said([MANY, NONE], {"loops": 0}) == {"loops.never": "No loop."}
    assert said(lambda e: {"loops.first": f"{e['loops']}"}, {"loops": 3}) == {"loops.first": "3"}
    assert say(lambda e: {"loops.a": "A.", "loops.b": "B."}, {}) == "A. B."


@pytest.mark.parametrize(
    ("share", "text"),
    [
        (0.0, "0%"),
        (0.0004, "less than 0.1%"),
        (0.5, "50.0%"),
        (0.9996, "more than 99.9%"),
        (1.0, "100%"),
    ],
)
def test_nearly_all_is_not_all(share, text):
    assert percent(share) == text
