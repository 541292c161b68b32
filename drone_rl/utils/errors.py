"""Errors that a user can correct."""

import difflib
import importlib
from collections.abc import Iterable
from typing import Any

_MOST_BITS = 10_000
"""Of a whole number in a message."""


class InputError(ValueError):
    """A user's mistake: an invalid setting, file or device.

    The message is one line with the value and the remedy. The command line prints it without a
    traceback and exits with a non-zero status; any other exception is a bug.
    """


def did_you_mean(name: object, names: Iterable[str]) -> str:
    """Return the end of a message with the known name that is most like an unknown one.

    Else it is the only one with the unknown name among its words, as in fov and horizontal_fov.
    """
    lower, word = {one.lower(): one for one in names}, str(name)[:100].lower()
    near = difflib.get_close_matches(word, lower, 1, 0.7)
    if not near:
        longer = [one for one in lower if word in one.split("_")]
        near = longer if len(longer) == 1 else []
    return f"; did you mean {lower[near[0]]}?" if near else ""


def extra(module: str, name: str, setting: str) -> Any:
    """Import a module of the extra `name`, or raise an `InputError` about `setting`."""
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise InputError(
            f"{setting} needs {module}, which isn't installed; "
            f"install it with pip install -e '.[{name}]' in the checkout"
        ) from error


def shown(value: Any) -> str:
    """Return a value for a message: short, on one line."""
    is_array = type(value).__module__ in ("numpy", "torch")
    value = value.item() if is_array and getattr(value, "shape", None) == () else value
    if isinstance(value, list | tuple) and len(value) <= 8:
        return f"[{','.join(map(_short, value))}]"
    return _short(value)


def _short(value: Any) -> str:
    if isinstance(value, type):
        return f"(the class {value.__name__})"
    if value is not None and not isinstance(value, str | int | float):
        return f"({type(value).__name__})"
    if isinstance(value, int) and value.bit_length() > _MOST_BITS:  # Python refuses to write it
        return f"(a number of {value.bit_length()} bits)"
    text = repr(value[:80] if isinstance(value, str) else value)
    return text if len(text) <= 80 else f"{text[:77]}..."
