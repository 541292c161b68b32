"""What is said of the exact map, word for word."""

import pytest

from drone_rl.explanations.report.places import rows, say_places
from drone_rl.utils.text import exact_percent
from tests.evidence import EXPLANATION, changed


def speak(**changes):
    return say_places(changed(EXPLANATION, {f"places.{k}": v for k, v in changes.items()}))


def test_what_it_does_by_side():
    assert speak()["places.does"] == (
        "With one cube 2.5 to 20 m ahead of its camera and up to 8 m to either side (exact, over "
        "all places), it goes left for 25.00% of those on its left, forward for 100% of those "
        "straight ahead and right for 50.00% of those on its right."
    )


def test_blindness_is_told_of_the_sides_that_have_it():
    assert speak()["places.blind"] == (
        "It does not react to 75.00% of those on its left and 50.00% of those on its right: a turn "
        "is needed, and it goes forward, as without a cube. It may react when the cube is nearer."
    )
    assert set(speak(blind=0.0)) - set(speak()) == {"places.sees"}


def test_the_closest_logits():
    assert speak()["places.gap"] == (
        "Its two highest logits come closest, to 1.2e-05, with the cube 7.25 m ahead and 1.50 m to "
        "the right."
    )
    assert "0.03% of the places they are no farther apart than 0.0001" in speak()["places.close"]


def test_without_a_map_only_that_is_said():
    found = say_places({"places": {"refused": "it sees a stack of frames"}})
    assert found == {
        "places.refused": "There is no exact map of this policy: it sees a stack of frames."
    }


@pytest.mark.parametrize(
    ("share", "text"),
    [
        (0.0, "0%"),
        (1e-9, "less than 0.01%"),
        (0.12345, "12.35%"),
        (0.999999, "more than 99.99%"),
        (1, "100%"),
    ],
)
def test_shares(share, text):
    assert exact_percent(share) == text


def test_rows():
    head, left, *_, every = rows(EXPLANATION["places"], ("forward", "left", "right"))
    assert head == [
        "one cube", "share of places", "forward", "left", "right", "not seen", "blind",
    ]  # fmt: skip
    assert left == ["on its left", "40.00%", "75.00%", "25.00%", "0%", "20.00%", "75.00%"]
    assert every == ["anywhere", "100%", "70.00%", "10.00%", "20.00%", "8.00%", "50.00%"]
