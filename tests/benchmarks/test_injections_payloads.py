"""Payloads."""

from benchmarks.injections import HOST, MARKUP, PAYLOADS, RAN


def test_there_are_enough_payloads_and_each_is_a_printable_line():
    assert len(set(PAYLOADS)) == len(PAYLOADS) >= 60
    assert all(payload.isprintable() and len(payload) <= 200 for payload in PAYLOADS)


def test_every_payload_has_a_detectable_effect():
    silent = [p for p in PAYLOADS if not any(mark in p for mark in (RAN, HOST, "alert"))]
    assert silent == []
    assert set(MARKUP) <= set(PAYLOADS) and all(payload.startswith("<") for payload in MARKUP)
