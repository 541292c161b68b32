"""Numbers and lists as people write them."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

ORDINALS = ("first", "second", "third", "fourth", "fifth", "sixth", "seventh", "eighth", "ninth")


def bounds(interval: Mapping[str, Any], show: Callable[[float], str] = "{:.2f}".format) -> str:
    """The 95% interval of a number."""
    return f"95%: {show(interval['lower95'])} to {show(interval['upper95'])}"


def among(share: Mapping[str, Any]) -> str:
    """A share as a count of so many."""
    return f"{share['successes']} of {share['trials']}"


def listed(parts: Sequence[str], last: str = "and") -> str:
    """A list in a sentence."""
    if len(parts) < 2:
        return "".join(parts)
    return f"{', '.join(parts[:-1])} {last} {parts[-1]}"


def plural(count: int, noun: str) -> str:
    """A count with its noun, whose plural is regular."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def ordinal(number: int) -> str:
    """What people call the thing with this index."""
    return ORDINALS[number] if number < len(ORDINALS) else f"{number + 1}th"


def all_cubes(count: int) -> str:
    """All cubes of a task that has so many."""
    return "the cube" if count == 1 else f"all {count} cubes"


def exact(share: float, is_all: bool = False) -> str:
    """A share in nine digits; 1 only of what is all, not of what is only nearly all."""
    text = f"{share:.9g}"
    return text if is_all or text != "1" else "more than 0.999999999"
