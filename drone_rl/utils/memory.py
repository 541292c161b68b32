"""Release of freed memory."""

import ctypes


def return_freed_memory() -> None:
    """Release freed memory to the operating system, on Linux.

    Batches differ in length, and the C library keeps freed blocks of every length.
    """
    try:
        ctypes.CDLL(None).malloc_trim(0)
    except (AttributeError, OSError, TypeError):  # another system's C library
        return
