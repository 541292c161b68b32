"""Import a user's own code, such as a registered part; its errors are one line with its file."""

import contextlib
import importlib.util
import os
import re
import sys
import sysconfig
import traceback
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from drone_rl.utils.errors import InputError

IMPORTED: list[str] = []
"""Modules, and absolute paths of files, that `plugins=` named; other processes must import them,
too, by `import_plugin`."""
_FOLDERS = (Path(__file__).parents[1], *map(sysconfig.get_path, ("stdlib", "purelib")))
_NAME = re.compile(r"[a-z][a-z0-9_]{0,60}")
_OTHERS = tuple(f"{folder}{os.sep}" for folder in _FOLDERS)
"""Folders of code that is not the user's."""


def import_plugin(name: str) -> str:
    """Import a module, or a Python file as the module of its stem, and add it to `IMPORTED`.

    Modules of the current folder, or of the file's, are found last: they replace no others.

    Args:
        name: A module's name, or the path of a file.

    Returns:
        The module's name, or the absolute path.

    Raises:
        InputError: It is not found, has the name of another module, or fails.
    """
    is_path = name.endswith(".py") or not name.replace(".", "").isidentifier()
    file = Path(name if is_path else f"{name}.py").absolute()
    module, plugin = (file.stem, str(file)) if is_path else (name, name)
    if is_path and not (file.suffix == ".py" and file.is_file() and "." not in module):
        raise InputError(
            f"plugins={name} is no Python file; give the path of one, NAME.py, or a module's name"
        )
    if str(file.parent) not in sys.path:
        sys.path.append(str(file.parent))
    if file.is_file():
        _refuse_other(module, file, name)
    try:
        importlib.import_module(module)
    except ModuleNotFoundError as error:
        is_plugin = f"{module}.".startswith(f"{error.name}.")  # or its package
        place = "give a module in this folder or on PYTHONPATH, or the path of a Python file"
        remedy = place if is_plugin else f"install {error.name}"
        reason = " in ".join(filter(None, (str(error), line_of(error))))
        raise InputError(f"plugins={name} can't be imported ({reason}); {remedy}") from error
    except (Exception, SystemExit) as error:  # any that the user's module raises
        raise InputError(failure(f"plugins={name}", error, name)) from error
    if plugin not in IMPORTED:
        IMPORTED.append(plugin)
    return plugin


def _refuse_other(module: str, file: Path, name: str) -> None:
    """Raise an `InputError` if the module's name is that of another module."""
    loaded = sys.modules.get(module)
    spec = importlib.util.find_spec(module) if loaded is None else None
    origin = getattr(loaded, "__file__", None) if spec is None else spec.origin
    if origin is None or Path(origin).resolve() != file.resolve():
        raise InputError(
            f"plugins={name}: the module {module} of {origin or 'Python'} has precedence over your "
            f"{file.name}; rename the file"
        )


def check_name(name: Any, decorator: str) -> None:
    """Raise an `InputError` unless a decorator of the package is called with a valid name."""
    if not isinstance(name, str):
        raise InputError(f'give a name in brackets, as in @drone_rl.{decorator}("mine")')
    if not _NAME.fullmatch(name):
        raise InputError(f"name={name!r} is invalid; give lower-case letters, digits and _")


def require_own(what: str, owner: str, module: str) -> None:
    """Raise an `InputError` if a name is that of another module's part; see `check_name`.

    A module that is imported again, or a cell that runs again, replaces its own.
    """
    if owner.startswith("drone_rl."):
        raise InputError(f"{what} is built in; give another name")
    if len({owner, module}) > 1 and "__main__" not in (owner, module):
        raise InputError(f"{what} is registered by {owner}, too; give another name")


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
