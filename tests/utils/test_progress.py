import logging
import time

import pytest

from drone_rl.utils.errors import InputError
from drone_rl.utils.progress import Bar, Heartbeat, Lines, as_progress, bar_or_lines, log, silent


def test_a_bar_ends_when_all_is_done(capsys):
    bar = Bar(interval_s=0.0)
    bar("flying", 1, 3)
    bar("done", 3, 3)
    assert "done" in capsys.readouterr().err


def test_rate_of_a_bar(capsys, monkeypatch):
    now = time.time()
    for clock in ("time.time", "tqdm.std.time"):
        monkeypatch.setattr(clock, lambda: now)
    bar = Bar()
    now += 4
    bar("flying", 8, 8)
    assert "00:04" in (shown := capsys.readouterr().err) and "2.00it/s" in shown
    now += 3  # between two pieces of work
    bar("landing", 1, 8)
    now += 1
    bar("landed", 8, 8)
    assert "00:04" in (shown := capsys.readouterr().err) and "2.00it/s" in shown


def test_a_line_in_the_log(caplog):
    with caplog.at_level(logging.INFO):
        log("flying", 1, 3)
        log("section")
    assert caplog.messages == ["[1/3] flying", "section"]
    silent("nothing")


def test_lines_every_few_seconds(caplog, monkeypatch):
    calls = {0.0: None, 1.0: 100, 4.0: 200, 6.0: 300, 9.0: 400, 9.5: 500, 15.0: 10}
    times = iter(calls)
    monkeypatch.setattr("time.monotonic", lambda: next(times))
    lines = Lines(interval_s=5.0)
    with caplog.at_level(logging.INFO):
        for done in filter(None, calls.values()):
            lines("flying", done, 500)
    assert caplog.messages == [
        "[300/500] flying, at most 5 s left at this rate",  # 200 steps in 5 s
        "[500/500] flying",
        "[10/500] flying",
    ]


def test_lines_where_there_is_no_terminal(monkeypatch):
    assert isinstance(bar_or_lines(), Lines)
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    assert isinstance(bar_or_lines(), Bar)


def test_progress_is_a_function_and_a_bar_by_default():
    assert isinstance(as_progress(None), Bar)
    assert as_progress(silent) is silent
    for wrong in (True, False, 5, "bar"):
        with pytest.raises(InputError, match=rf"^progress={wrong!r} is no function; leave it out"):
            as_progress(wrong)  # pyright: ignore[reportArgumentType]


def wait_for(condition):
    until = time.monotonic() + 30
    while not condition():
        assert time.monotonic() < until
        time.sleep(0.01)


def test_heartbeat(caplog):
    caplog.set_level(logging.INFO)
    with Heartbeat(silence_s=0.05):
        log("flying", 1, 3)
        wait_for(lambda: len(caplog.messages) > 2)
    first, *lines = caplog.messages
    assert first == "[1/3] flying"
    assert all(line.startswith("still running after ") for line in lines)
    assert {line.partition(" s: ")[2] for line in lines} == {"last line: [1/3] flying"}
    after = len(caplog.messages)
    time.sleep(0.2)
    assert len(caplog.messages) == after  # it ends with the work
