"""Numbers and lists as people write them."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any


def bounds(found: Mapping[str, Any], show: Callable[[float], str] = "{:.2f}".format) -> str:
    """The 95% interval of a number."""
    return f"95%: {show(found['lower95'])} to {show(found['upper95'])}"


def among(found: Mapping[str, Any]) -> str:
    """A share as a count of so many."""
    return f"{found['successes']} of {found['trials']}"


def listed(parts: Sequence[str], last: str = "and") -> str:
    """A list in a sentence."""
    if len(parts) < 2:
        return "".join(parts)
    return f"{', '.join(parts[:-1])} {last} {parts[-1]}"


def plural(count: int, noun: str) -> str:
    """A count with its noun, whose plural is regular."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"
