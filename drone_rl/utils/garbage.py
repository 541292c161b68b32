"""When not to look for garbage."""

import contextlib
import gc
from collections.abc import Iterator


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


def leave_garbage_to_the_system() -> None:
    """Spares the interpreter its last search for garbage, which takes a second with torch.

    For programs that are about to end, not for libraries: what is garbage now stays in memory.
    """
    gc.freeze()
