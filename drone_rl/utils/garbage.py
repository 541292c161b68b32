"""When not to look for garbage."""

import contextlib
import gc
from collections.abc import Iterator


@contextlib.contextmanager
def collecting_no_garbage() -> Iterator[None]:
    """Lets Python's collector rest, as during imports: they leave none, and it costs a fifth.

    What is there afterwards is never looked through again.
    """
    was_on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        gc.freeze()
        if was_on:
            gc.enable()


def leave_garbage_to_the_system() -> None:
    """Spares the interpreter its last search for garbage, which takes a second with torch."""
    gc.freeze()
