"""Counts of a client's calls, and remarks on those that do not do all that they ask for."""

import contextlib
import logging
from collections import Counter
from collections.abc import Callable, Iterator
from contextvars import ContextVar
from typing import Any

_log = logging.getLogger(__name__)

_NOTE: ContextVar[Callable[[str], None]] = ContextVar("note", default=lambda words: None)
"""Takes the remarks on the present call."""
_MOST = 1000
"""Different methods, and different remarks, that are counted."""


def remark(words: str) -> None:
    """Note why the present call has no effect, or not all of it; do nothing outside of a call."""
    _NOTE.get()(words)


class Calls:
    """The calls of one client."""

    def __init__(self) -> None:
        """Begin without calls."""
        self._made: Counter[str] = Counter()
        self._remarks: Counter[str] = Counter()

    @contextlib.contextmanager
    def call(self, client: str, method: str) -> Iterator[None]:
        """Count a call, and log the remarks on it that are new, before it is answered."""
        method = _printable(method)
        _count(self._made, method)
        noted: set[str] = set()

        def note(words: str) -> None:
            words = f"{method}: {_printable(words)}"
            if words not in noted and _count(self._remarks, words) == 1:
                _log.warning("%s: %s", client, words)
            noted.add(words)

        token = _NOTE.set(note)
        try:
            yield
        finally:
            _NOTE.reset(token)

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
