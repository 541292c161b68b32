"""Counts of a client's calls, and remarks on those that do not do all that they ask for."""

import contextlib
import logging
from collections import Counter
from collections.abc import Iterator
from contextvars import ContextVar
from typing import Any

_log = logging.getLogger(__name__)

_REMARKS: ContextVar[list[str]] = ContextVar("remarks")
_MOST = 1000
"""Different methods, and different remarks, that are counted."""


def remark(words: str) -> None:
    """Note why the present call has no effect, or not all of it; do nothing outside of a call."""
    _REMARKS.get([]).append(words)


class Calls:
    """The calls of one client."""

    def __init__(self) -> None:
        """Begin without calls."""
        self._made: Counter[str] = Counter()
        self._remarks: Counter[str] = Counter()

    @contextlib.contextmanager
    def call(self, client: str, method: str) -> Iterator[None]:
        """Count a call, and log the remarks on it that are new."""
        method = _printable(method)
        _count(self._made, method)
        remarks: list[str] = []
        token = _REMARKS.set(remarks)
        try:
            yield
        finally:
            _REMARKS.reset(token)
            for words in dict.fromkeys(f"{method}: {_printable(words)}" for words in remarks):
                if _count(self._remarks, words) == 1:
                    _log.warning("%s: %s", client, words)

    def __str__(self) -> str:
        """Return a summary of some lines."""
        made = ", ".join(f"{name} {count}" for name, count in self._made.most_common())
        lines = [f"{self._made.total()} calls{': ' if made else ''}{made}"]
        if self._remarks:
            lines.append("without effect, or with a part of it:")
            lines += [f"  {count} x {words}" for words, count in self._remarks.most_common()]
        return "\n".join(lines)


def _printable(text: str) -> str:
    """Escape what would end a line of the log or control a terminal."""
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text)


def _count(counter: Counter[Any], key: str) -> int:
    """Count a key, unless there are too many; return its count."""
    if key in counter or len(counter) < _MOST:
        counter[key] += 1
    return counter[key]
