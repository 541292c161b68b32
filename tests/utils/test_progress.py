import logging

from drone_rl.utils.progress import Bar, log, silent


def test_a_bar_ends_when_all_is_done(capsys):
    bar = Bar(interval_s=0.0)
    bar("flying", 1, 3)
    bar("flying", 2, 3)
    assert bar._bar is not None
    bar("done", 3, 3)
    assert bar._bar is None
    assert "done" in capsys.readouterr().err


def test_a_bar_is_not_drawn_all_the_time():
    bar = Bar(interval_s=1e9)
    bar._drawn_at = float("inf")
    bar("flying", 1, 3)
    assert bar._bar is None
    bar("done", 3, 3)  # the end is always told
    assert bar._bar is None


def test_a_line_in_the_log(caplog):
    with caplog.at_level(logging.INFO):
        log("flying", 1, 3)
        log("section")
    assert caplog.messages == ["[1/3] flying", "section"]
    silent("nothing")
