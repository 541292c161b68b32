"""Packages that only some need, and what to tell those who lack them."""

import importlib
from typing import Any

from drone_rl.utils.errors import InputError


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
