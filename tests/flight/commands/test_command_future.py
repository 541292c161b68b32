from drone_rl.flight.commands.command import FlightFuture, TimedCommand


def make(wait=lambda future: future.finish(True)):
    return FlightFuture("land", TimedCommand(None, 1.0), wait)


def test_its_result_is_waited_for():
    future = make()
    assert not future.done
    assert "running for 0.00 s" in repr(future)
    assert future.result() is True
    assert future.done
    assert not future.cancelled
    assert repr(future) == "<land: done in 0.00 s>"


def test_what_is_cancelled_has_failed():
    future = make()
    future.cancel()
    assert (future.done, future.cancelled, future.result()) == (True, True, False)
    assert repr(future) == "<land: cancelled after 0.00 s>"


def test_what_is_done_is_not_cancelled():
    future = make()
    future.finish(False)
    future.cancel()
    assert (future.cancelled, future.result()) == (False, False)
    assert "failed" in repr(future)
