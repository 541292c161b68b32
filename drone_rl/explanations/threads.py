"""Which sections of an explanation can be made beside others, in another thread."""

import threading
from collections.abc import Callable
from typing import Any, Generic, TypeVar

F = TypeVar("F", bound=Callable[..., Any])
T = TypeVar("T")
_MARK = "is_aside"


def aside(section: F) -> F:
    """Marks a section that reads the data set alone: it moves no world and changes no network.

    It is made in a thread of its own, with the data set made before.
    """
    setattr(section, _MARK, True)
    return section


def is_aside(section: Callable[..., Any]) -> bool:
    """Whether a section is marked so."""
    return getattr(section, _MARK, False)


class Once(Generic[T]):
    """What is made by the thread that asks first; others wait for it."""

    def __init__(self) -> None:
        """Nothing is made yet."""
        self._lock = threading.Lock()
        self._made: list[T] = []

    def get(self, make: Callable[[], T]) -> T:
        """The same for everybody.

        Args:
            make: Makes it, if nobody has.
        """
        with self._lock:
            if not self._made:
                self._made.append(make())
            return self._made[0]
