"""Progress of long work: a bar, lines in the log, or nothing."""

import logging
import time
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


def as_progress(given: Progress | None) -> Progress:
    """Return an argument `progress`, a bar by default; raise an `InputError` for other values."""
    if given is not None and not callable(given):
        raise InputError(
            f"progress={shown(given)} is no function; leave it out for a bar, or give "
            "drone_rl.utils.progress.silent for none"
        )
    return given or Bar()


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
