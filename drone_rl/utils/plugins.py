"""Errors of a user's own code, such as a registered part: one line with its file."""

import contextlib
import os
import sys
import sysconfig
import traceback
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from drone_rl.utils.errors import InputError

IMPORTED: list[str] = []
"""Modules that `plugins=` named; other processes must import them, too."""
_FOLDERS = (Path(__file__).parents[1], *map(sysconfig.get_path, ("stdlib", "purelib")))
_OTHERS = tuple(f"{folder}{os.sep}" for folder in _FOLDERS)
"""Folders of code that is not the user's."""


def place_of(code: Callable[..., Any]) -> str:
    """Return the name of a class or function, with its file, for messages."""
    file = getattr(sys.modules.get(code.__module__), "__file__", None) or code.__module__
    return f"{code.__qualname__} of {file}"


def line_of(error: BaseException) -> str:
    """Return the user's line that raised an error, with its file; "" if none did."""
    if isinstance(error, SyntaxError) and error.filename:
        return f"line {error.lineno} of {error.filename}"
    frames = traceback.extract_tb(error.__traceback__)
    of_user = (f for f in reversed(frames) if not f.filename.startswith(("<frozen", *_OTHERS)))
    return next((f"line {frame.lineno} of {frame.filename}" for frame in of_user), "")


def failure(what: str, error: BaseException, place: str = "") -> str:
    """Return the message about user's code that raised an error, with the line of its own files.

    `what` is the setting that selects the code. `place` is named if no line of its own is known.
    """
    where, reason = line_of(error) or place, " ".join(str(error).split())
    if isinstance(error, InputError):
        return f"{where}: {reason}"
    return f"{what} failed in {where} ({type(error).__name__}: {reason}); correct it"


@contextlib.contextmanager
def errors_of(what: str, place: str) -> Iterator[None]:
    """Raise an `InputError` for any other error of a user's code; see `failure`."""
    try:
        yield
    except InputError:
        raise
    except Exception as error:
        raise InputError(failure(what, error, place)) from error


def described(value: Any) -> str:
    """Return the type of a value, and the shape of an array, for messages."""
    if value is None:
        return "None"
    shape = getattr(value, "shape", None)
    return f"a {type(value).__name__}" + ("" if shape is None else f" of shape {tuple(shape)}")
