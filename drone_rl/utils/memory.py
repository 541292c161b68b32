"""Bounds on memory and on the time that Python's garbage collector takes.

Batches differ in length, and two caches grow with every new length: the C library keeps freed
blocks, of which ever fewer fit, and oneDNN compiles a kernel for each input shape and keeps a
thousand of them.
"""

import contextlib
import ctypes
import functools
import gc
import os
from collections.abc import Callable, Iterator

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


@contextlib.contextmanager
def collecting_no_garbage() -> Iterator[None]:
    """Lets Python's collector rest, as during imports: they leave none, and it costs a fifth."""
    was_on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_on:
            gc.enable()


def look_for_garbage_rarely() -> None:
    """Lets Python's collector look once in 50,000 new objects, not in 700: it finds next to none.

    For programs, not for libraries: half a million objects come with torch, and looking through
    them, even once, takes a third of a second. So when there are more than these, whatever is there
    is set aside for good, and only what is made from then on is looked at.
    """
    gc.set_threshold(700_000, 50, 100)
    gc.callbacks.append(_from_now_on)


def _from_now_on(phase: str, info: dict[str, int]) -> None:
    """Is called before the first look: it finds nothing to look at."""
    del phase, info
    gc.callbacks.remove(_from_now_on)
    gc.freeze()
    gc.set_threshold(50_000, 50, 100)
