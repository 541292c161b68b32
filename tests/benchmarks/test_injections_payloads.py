"""The strings that would run."""

from benchmarks.injections import HOST, MARKUP, PAYLOADS, RAN


def test_there_are_enough_and_readers_of_files_accept_them():
    assert len(set(PAYLOADS)) == len(PAYLOADS) >= 60
    assert all(payload.isprintable() and len(payload) <= 200 for payload in PAYLOADS)


def test_each_would_be_noticed():
    silent = [p for p in PAYLOADS if not any(mark in p for mark in (RAN, HOST, "alert"))]
    assert silent == []
    assert set(MARKUP) <= set(PAYLOADS) and all(payload.startswith("<") for payload in MARKUP)
