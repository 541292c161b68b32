"""Memory that a long training would hold without using it: what fills it, and its return.

Batches differ in length, and two things grow with every length that comes up. The C library keeps
freed blocks for later, ever less of them fit, and the gaps stay resident. And PyTorch's library of
CPU kernels, oneDNN, compiles each for the shape of its input and keeps a thousand of them.
"""

import ctypes
import functools
import os
from collections.abc import Callable

KEPT_KERNELS = 128
"""Enough for two layers and every number of up to 32 worlds under way at a time, and a batch."""


def bound_kernels() -> None:
    """Lets oneDNN keep so many kernels; without effect once one has run in this process."""
    os.environ.setdefault("ONEDNN_PRIMITIVE_CACHE_CAPACITY", str(KEPT_KERNELS))


def return_freed_memory() -> None:
    """Gives blocks that were freed back to the system, where the C library can: on Linux."""
    _trim()(0)


@functools.cache
def _trim() -> Callable[[int], int]:
    try:
        return ctypes.CDLL(None).malloc_trim
    except (AttributeError, OSError, TypeError):  # another system's C library
        return lambda _: 0
