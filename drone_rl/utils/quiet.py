"""What other libraries print that says nothing to a user."""

import contextlib
import os
import sys
import warnings
from collections.abc import Iterator
from typing import Any

from absl import logging

NOISE = ("DISPLAY", "GLFW", "WeightUpdaterBase")
"""Words in warnings of dm_control, which looks for a screen, and of TorchRL, of its own classes."""


def ignore_noise() -> None:
    """Keeps warnings and log lines back that no user can do anything about.

    Filters would not do: dm_control puts one of its own, that lets all through, before them.
    """
    show = warnings.showwarning

    def show_the_rest(message: Warning | str, *args: Any, **kwargs: Any) -> None:
        if not any(word in str(message) for word in NOISE):
            show(message, *args, **kwargs)

    warnings.showwarning = show_the_rest
    logging.set_verbosity(logging.WARNING)  # dm_control tells which OpenGL it found


@contextlib.contextmanager
def noise_held_back() -> Iterator[None]:
    """The same for a while, such as an import: warnings are shown as before afterwards."""
    with warnings.catch_warnings():
        ignore_noise()
        yield


@contextlib.contextmanager
def standard_error_closed() -> Iterator[None]:
    """Lets nothing through to standard error, not even from below Python."""
    sys.stderr.flush()
    kept = os.dup(2)
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 2)
        yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)
        os.close(nowhere)
