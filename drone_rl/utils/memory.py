"""Bounds on memory, and on the time of Python's garbage collector and of its calls.

Batches differ in length, and two caches grow with every new length: the C library keeps freed
blocks, and oneDNN keeps a thousand kernels, one for each input shape.
"""

import contextlib
import functools
import gc
import os
import threading
from collections.abc import Callable, Iterator
from typing import TypeVar

T = TypeVar("T")
_ENVIRONMENT = threading.Lock()

_STACK = 20_000
"""Values on Python's stack that fit into one block of memory, 8 bytes each."""
KEPT_KERNELS = 128
"""Enough for two layers, up to 32 active environments, and a batch."""


def bound_kernels() -> None:
    """Limit oneDNN's cache of kernels; no effect once a kernel has run in this process.

    oneDNN reads the limit from the environment with its first kernel, which this runs. A limit of
    the user's own has precedence.
    """
    import torch  # not at the start of every program

    name = "ONEDNN_PRIMITIVE_CACHE_CAPACITY"
    with _ENVIRONMENT:
        if name in os.environ or not torch.backends.mkldnn.is_available():
            return
        os.environ[name] = str(KEPT_KERNELS)
        try:
            one = torch.zeros(1, 1, 1, 1, device="cpu")
            torch.mkldnn_convolution(one, one, None, [0, 0], [1, 1], [1, 1], 1)
        finally:
            del os.environ[name]


def return_freed_memory() -> None:
    """Release freed memory to the operating system, on Linux."""
    _trim()(0)


@functools.cache
def _trim() -> Callable[[int], int]:
    import ctypes  # not at the start of every program

    try:
        return ctypes.CDLL(None).malloc_trim
    except (AttributeError, OSError, TypeError):  # another system's C library
        return lambda _: 0


@contextlib.contextmanager
def collecting_no_garbage() -> Iterator[None]:
    """Disable Python's collector, as during imports, where it takes a fifth of the time."""
    was_on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_on:
            gc.enable()


def look_for_garbage_rarely() -> None:
    """Make Python's collector run once in 50,000 new objects instead of 700.

    Only for programs, as it changes the whole process. Imports create half a million objects, which
    the collector would traverse in a third of a second or more. These are excluded from collection
    when it first runs.
    """
    gc.set_threshold(700_000, 50, 100)
    gc.callbacks.append(_from_now_on)


def with_one_stack_block(function: Callable[[], T]) -> T:
    """Call a function such that all frames of its calls, and of theirs, lie in one block of memory.

    CPython allocates frames in blocks of 16 KiB and frees a block when its last frame returns. A
    loop whose calls begin just below the end of a block allocates and frees one in every iteration;
    an import of Warp at that depth takes 0.25 s longer. A frame that is larger than a block gets a
    larger one, whose rest serves the frames above it.
    """

    def call() -> T:
        return function()

    call.__code__ = call.__code__.replace(co_stacksize=_STACK)
    return call()


def _from_now_on(phase: str, info: dict[str, int]) -> None:
    """Exclude all existing objects before the first collection."""
    del phase, info
    gc.callbacks.remove(_from_now_on)
    gc.freeze()
    gc.set_threshold(50_000, 50, 100)
