"""Bounds on memory.

Batches differ in length, and two caches grow with every new length: the C library keeps freed
blocks, and oneDNN keeps a thousand kernels, one for each input shape.
"""

import functools
import os
import threading
from collections.abc import Callable

_ENVIRONMENT = threading.Lock()

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
