"""How long work says how far it is: a bar, a log, nothing, or whatever else is called."""

import logging
import time
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from tqdm.auto import tqdm

_log = logging.getLogger(__name__)


class Progress(Protocol):
    """Is called now and then by all that takes long."""

    def __call__(self, text: str, done: int = 0, total: int = 0) -> None:
        """Takes note.

        Args:
            text: What is being done.
            done: How much of it.
            total: Of how much, at most; 0 where nobody knows.
        """
        ...


def silent(text: str, done: int = 0, total: int = 0) -> None:
    """Says nothing."""


def log(text: str, done: int = 0, total: int = 0) -> None:
    """One line in the log."""
    _log.info("%s", f"[{done}/{total}] {text}" if total else text)


class Bar:
    """A bar, in a notebook or a terminal; ends when all is done."""

    def __init__(self, interval_s: float = 0.1) -> None:
        """Sets the least time between two looks."""
        self._interval_s = interval_s
        self._bar: tqdm | None = None
        self._drawn_at = 0.0

    def __call__(self, text: str, done: int = 0, total: int = 0) -> None:
        """See `Progress`."""
        is_over = bool(total) and done >= total
        if not is_over and time.monotonic() - self._drawn_at < self._interval_s:
            return
        self._drawn_at = time.monotonic()
        if self._bar is None:
            from tqdm.auto import tqdm  # slow to import

            self._bar = tqdm(total=total or None, leave=True)
        self._bar.total = total or None
        self._bar.set_postfix_str(text, refresh=False)
        self._bar.update(done - self._bar.n)
        if is_over:
            self.close()

    def close(self) -> None:
        """Ends the bar; the next call begins another."""
        if self._bar is not None:
            self._bar.close()
        self._bar = None
