"""Progress of long work: a bar, lines in the log, or nothing; and a line in long silences."""

import logging
import sys
import threading
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Protocol

from drone_rl.utils.errors import InputError
from drone_rl.utils.schema import shown

if TYPE_CHECKING:
    from tqdm.auto import tqdm

_log = logging.getLogger(__name__)


class Progress(Protocol):
    """A function that long work calls repeatedly."""

    def __call__(self, text: str, done: int = 0, total: int = 0) -> None:
        """Report that `done` of at most `total` (0 if unknown) steps of `text` are done."""
        ...


def silent(text: str, done: int = 0, total: int = 0) -> None:
    """Report nothing."""


def log(text: str, done: int = 0, total: int = 0) -> None:
    """Write one line to the log."""
    _log.info("%s", f"[{done}/{total}] {text}" if total else text)


def as_progress(progress: Progress | None) -> Progress:
    """Return an argument `progress`, a bar by default; raise an `InputError` for other values."""
    if progress is not None and not callable(progress):
        raise InputError(
            f"progress={shown(progress)} is no function; leave it out for a bar, or give "
            "drone_rl.utils.progress.silent for none"
        )
    return progress or Bar()


class Bar:
    """A progress bar in a notebook or a terminal, closed when the work is done."""

    def __init__(self, interval_s: float = 0.1) -> None:
        """Set the least time between two updates."""
        self._interval_s = interval_s
        self._bar: tqdm | None = None
        self._drawn_at = 0.0
        self._began = time.time()

    def __call__(self, text: str, done: int = 0, total: int = 0) -> None:
        """See `Progress`."""
        is_over = bool(total) and done >= total
        if not is_over and time.monotonic() - self._drawn_at < self._interval_s:
            return
        self._drawn_at = time.monotonic()
        note_shown()
        if self._bar is None:
            from tqdm.auto import tqdm  # slow to import

            self._bar = tqdm(total=total or None, leave=True)
            self._bar.start_t = self._bar.last_print_t = self._began  # of the work, for its rate
        self._bar.total = total or None
        self._bar.set_postfix_str(text, refresh=False)
        self._bar.update(done - self._bar.n)
        if is_over:
            self.close()

    def close(self) -> None:
        """Close the bar; the next call opens another."""
        if self._bar is not None:
            self._bar.close()
        self._bar, self._began = None, time.time()


class Lines:
    """A line in the log every few seconds, and when the work is done."""

    def __init__(self, interval_s: float = 5.0) -> None:
        """Set the least time between two lines."""
        self._interval_s = interval_s
        self._said_at = time.monotonic()
        self._first: tuple[int, float] | None = None
        """Steps done at the first call of the present work, and its time."""

    def __call__(self, text: str, done: int = 0, total: int = 0) -> None:
        """See `Progress`."""
        now = time.monotonic()
        before, began = self._first or (done, now)
        is_over = bool(total) and done >= total
        self._first = None if is_over else (before, began)
        if not is_over and now - self._said_at < self._interval_s:
            return
        self._said_at = now
        if before < done < total:
            left = (now - began) * (total - done) / (done - before)
            text = f"{text}, at most {left:.0f} s left at this rate"
        log(text, done, total)


def bar_or_lines() -> Progress:
    """Return a bar for a terminal, lines in the log for anything else."""
    return Bar() if sys.stderr.isatty() else Lines()


_shown_at = [time.monotonic()]


def note_shown() -> None:
    """Note that the user has just been shown progress, for `Heartbeat`."""
    _shown_at[0] = time.monotonic()


class Heartbeat(logging.Handler):
    """Log a line after each half minute in which a command has shown no progress.

    with Heartbeat():
        run_long_command()
    """

    _LINE = "still running after %.0f s%s"

    def __init__(self, describe: Callable[[], str] | None = None, silence_s: float = 30.0) -> None:
        """Set what returns the state of the work, by default the last logged message."""
        super().__init__()
        self._describe = describe or (lambda: self._last and f"last line: {self._last}")
        self._silence_s, self._last = silence_s, ""
        self._over, self._began = threading.Event(), time.monotonic()

    def emit(self, record: logging.LogRecord) -> None:
        """Note a line of the log."""
        note_shown()
        if record.msg != self._LINE:
            self._last = record.getMessage()

    def __enter__(self) -> "Heartbeat":
        note_shown()
        logging.getLogger().addHandler(self)
        threading.Thread(target=self._watch, name="heartbeat", daemon=True).start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        logging.getLogger().removeHandler(self)

    def _watch(self) -> None:
        left = self._silence_s
        while not self._over.wait(left):
            left = _shown_at[0] + self._silence_s - time.monotonic()
            if left <= 0:
                state = self._describe()
                state = f": {state}" if state else ""
                _log.info(self._LINE, time.monotonic() - self._began, state)
                left = self._silence_s
