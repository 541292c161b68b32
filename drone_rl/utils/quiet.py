"""What other libraries print that says nothing to a user."""

import contextlib
import os
import sys
import warnings
from collections.abc import Iterator

from absl import logging

NOISE = (".*DISPLAY.*", ".*GLFW.*", ".*WeightUpdaterBase.*")
"""Warnings of dm_control, which looks for a screen, and of TorchRL, of its own classes."""


def ignore_noise() -> None:
    """Keeps warnings and log lines back that no user can do anything about."""
    for message in NOISE:
        warnings.filterwarnings("ignore", message=message)
    logging.set_verbosity(logging.WARNING)  # dm_control tells which OpenGL it found


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
