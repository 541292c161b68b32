"""Places for texts, and pages with an inserted text."""

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


def test_places_are_names_and_text_values():
    found = set(places(PLAIN))
    assert ((("a",), True)) in found and ((("a",), False)) in found
    assert (("b", 0, "kind"), False) in found and (("b", 0, "free"), True) in found
    assert (("b", 0, "free"), False) not in found  # a number
    assert len(found) == 2 + 1 + 2 * 3


def test_put_replaces_texts_at_places_and_keeps_names_unique():
    where = frozenset({(("a",), False), (("b", 1, "kind"), True), (("b", 1, "free"), True)})
    assert put(PLAIN, where, "T") == {
        "a": "T",
        "b": [{"kind": "good", "free": 1}, {"T0": "poor", "T1": 2}],
    }


def test_accepted_returns_places_that_accept_a_text_together():
    def works(value):
        for item in value["b"]:
            assert item["kind"] in ("good", "poor")

    kept = accepted(PLAIN, works)
    assert kept == {(("a",), False), (("b", 0, "free"), True), (("b", 1, "free"), True)}


def test_places_for_short_texts_only_are_found():
    def works(value):
        assert len(value["a"]) < 40

    assert (("a",), False) in accepted(PLAIN, works)
    assert (("a",), False) not in accepted(PLAIN, works, probe="x" * 50)
    assert len(_LONG_PROBE) > max(map(len, PAYLOADS))


def test_pages_without_policy_and_without_escaping():
    page = '<head><meta http-equiv="Content-Security-Policy" content="x"></head><nav></nav>'
    assert without_policy(page) == "<head></head><nav></nav>"
    assert "<nav></nav><b>x" in with_markup(page, "<b>x")
