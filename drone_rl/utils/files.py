"""Files that are whole or not there, and folders that belong to one process at a time."""

import contextlib
import errno
import fcntl
import os
import time
from collections.abc import Iterator
from pathlib import Path

from drone_rl.utils.errors import InputError

_NO_LOCKS = (errno.ENOLCK, errno.ENOTSUP)
"""What file systems answer that know no locks."""


def write_atomically(path: Path, content: str | bytes) -> None:
    """Writes a small file; whoever reads it finds the old one or the new one, never half."""
    temporary = path.with_name(f".{path.name}.{os.getpid()}")
    temporary.write_bytes(content.encode() if isinstance(content, str) else content)
    os.replace(temporary, path)


@contextlib.contextmanager
def folder_lock(folder: Path, *, patience_s: float = 1.0) -> Iterator[None]:
    """Holds a folder while the process lives; the system lets go of it however it ends.

    Args:
        folder: Must exist.
        patience_s: How long to try, which outlasts a look by `is_locked`.

    Raises:
        InputError: Another process holds it.
    """
    with (folder / ".lock").open("a") as file:
        until = time.monotonic() + patience_s
        while not _try_lock(file.fileno()):
            if time.monotonic() > until:
                raise InputError(
                    f"another process is at work in {folder}; wait until it has ended or stop it"
                )
            time.sleep(0.05)
        yield


def is_locked(folder: Path) -> bool:
    """Whether some process holds the folder."""
    try:
        with (folder / ".lock").open("a") as file:
            return not _try_lock(file.fileno())
    except FileNotFoundError:
        return False


def _try_lock(descriptor: int) -> bool:
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError as error:
        if error.errno not in _NO_LOCKS:
            raise
    return True
