"""Errors that a user can correct."""

import importlib
from typing import Any


class InputError(ValueError):
    """A mistake in what the user gave: a setting, a file, a device.

    The message is one line that names the value received and the remedy. The command line prints
    it without a traceback and exits with a non-zero status; any other exception is a bug of ours.
    """


def extra(module: str, name: str, setting: str) -> Any:
    """Imports a module of an optional extra.

    Args:
        module: To import.
        name: The extra that brings it.
        setting: What asked for it.

    Raises:
        InputError: It isn't installed.
    """
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise InputError(
            f"{setting} needs {module}, which isn't installed; "
            f"install it with pip install 'drone-rl[{name}]'"
        ) from error
