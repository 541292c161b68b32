"""Signals that stop a training after its current update."""

import contextlib
import signal
import threading
import time
from collections.abc import Callable, Iterator
from types import FrameType

_REPEAT_S = 1.0
"""Seconds in which another SIGTERM is the same request: a cluster and a sweep may both send it."""


@contextlib.contextmanager
def noted_signals(note: Callable[[int], None]) -> Iterator[None]:
    """Call `note` with the first Ctrl-C or SIGTERM; the next one acts at once.

    Another SIGTERM within `_REPEAT_S` counts as the same one. A signal that the process ignores, as
    Ctrl-C in the background, is noted, too. Only in the main thread.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    handlers = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    # one set outside Python can't be restored, so it is left alone
    before = {number: handler for number, handler in handlers.items() if handler is not None}
    first_s: float | None = None

    def restore() -> None:
        for number, handler in before.items():
            signal.signal(number, handler)

    def handle(number: int, frame: FrameType | None) -> None:
        nonlocal first_s
        del frame
        if first_s is None:
            first_s = time.monotonic()
            note(number)
        elif number == signal.SIGINT or time.monotonic() - first_s > _REPEAT_S:
            restore()
            signal.raise_signal(number)

    for number in before:
        signal.signal(number, handle)
    try:
        yield
    finally:
        restore()
