"""Which sections of an explanation can be made beside others, in another thread."""

from collections.abc import Callable
from typing import Any, TypeVar

F = TypeVar("F", bound=Callable[..., Any])
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
