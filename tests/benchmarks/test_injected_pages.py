"""Where a text can be put, and what pages are made of it."""

from benchmarks.injected_pages import (
    _LONG_PROBE,
    accepted,
    places,
    put,
    with_markup,
    without_policy,
)
from benchmarks.injections import PAYLOADS

PLAIN = {"a": "x", "b": [{"kind": "good", "free": 1}, {"kind": "poor", "free": 2}]}


def test_places_are_names_and_values_that_are_texts():
    found = set(places(PLAIN))
    assert ((("a",), True)) in found and ((("a",), False)) in found
    assert (("b", 0, "kind"), False) in found and (("b", 0, "free"), True) in found
    assert (("b", 0, "free"), False) not in found  # a number
    assert len(found) == 2 + 1 + 2 * 3


def test_a_text_is_put_where_it_is_asked_for_and_names_stay_different():
    where = frozenset({(("a",), False), (("b", 1, "kind"), True), (("b", 1, "free"), True)})
    assert put(PLAIN, where, "T") == {
        "a": "T",
        "b": [{"kind": "good", "free": 1}, {"T0": "poor", "T1": 2}],
    }


def test_places_that_work_are_kept_together():
    def works(value):
        for item in value["b"]:
            assert item["kind"] in ("good", "poor")

    kept = accepted(PLAIN, works)
    assert kept == {(("a",), False), (("b", 0, "free"), True), (("b", 1, "free"), True)}


def test_places_for_short_texts_alone_are_known():
    def works(value):
        assert len(value["a"]) < 40

    assert (("a",), False) in accepted(PLAIN, works)
    assert (("a",), False) not in accepted(PLAIN, works, probe="x" * 50)
    assert len(_LONG_PROBE) > max(map(len, PAYLOADS))


def test_pages_are_robbed_of_one_defence_each():
    page = '<head><meta http-equiv="Content-Security-Policy" content="x"></head><nav></nav>'
    assert without_policy(page) == "<head></head><nav></nav>"
    assert "<nav></nav><b>x" in with_markup(page, "<b>x")
