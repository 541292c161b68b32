"""Safe reading of regular files, atomic writing, and locks on folders."""

import contextlib
import errno
import fcntl
import json
import math
import os
import re
import stat
import time
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, BinaryIO

from drone_rl.utils.errors import InputError, shown
from drone_rl.utils.limits import SMALL_JSON_BYTES

_NO_LOCKS = (errno.ENOLCK, errno.ENOTSUP)
"""Errors of file systems without locks."""


def as_path(value: str | Path, where: str) -> Path:
    """Return the path of an argument named `where`; raise an `InputError` if it is none."""
    if not isinstance(value, str | os.PathLike) or value == "":
        raise InputError(f"{where}={shown(value)} is no path; give the path of a file or folder")
    return Path(value)


def make_folder(folder: Path) -> None:
    """Make a folder and its parents, or raise an `InputError` if that is not possible."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(
            f"folder={folder} can't be made ({error.strerror}); give another folder"
        ) from error


def read_bytes(path: Path, most: int) -> bytes:
    """Return the content of a regular file of at most `most` bytes, opened once, without waiting.

    Raises:
        InputError: It can't be read, is no regular file, is empty or too large.
    """
    with _open_plain(path) as (file, size):
        content = file.read(most + 1) if size <= most else None
    if content is None or len(content) > most:
        raise InputError(f"{path} is too large; files of its kind have at most {most} bytes")
    if not content:
        raise InputError(f"{path} is empty; the file was damaged or cut short")
    return content


def read_tail(path: Path, most: int) -> bytes:
    """Return the last `most` bytes of a regular file, as a log; see `read_bytes` for errors."""
    with _open_plain(path) as (file, size):
        file.seek(max(0, size - most))
        return file.read(most)


@contextlib.contextmanager
def _open_plain(path: Path) -> Iterator[tuple[BinaryIO, int]]:
    """Open a regular file, without waiting for a pipe's writer; yield the file and its size."""
    try:
        with open(path, "rb", opener=lambda p, flags: os.open(p, flags | os.O_NONBLOCK)) as file:
            about = os.fstat(file.fileno())
            if not stat.S_ISREG(about.st_mode):
                raise InputError(f"{path} is no regular file; give the path of a file")
            yield file, about.st_size
    except InputError:
        raise
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(f"{path} can't be read ({reason}); give another file") from None


def new_run_folder(command: str, outputs: str | Path = "outputs") -> Path:
    """Return a path named by the present time, as `drone-rl` names the folders of a command."""
    now = time.time()
    stamp = time.strftime("%Y-%m-%d_%H-%M-%S", time.localtime(now))
    return Path(outputs) / command / "runs" / f"{stamp}-{int(now % 1 * 1e6):06d}"


def last_of(folder: Path) -> Path:
    """Return the path of a run's newest checkpoint."""
    return folder / "checkpoints" / "last.pt"


def newest_first(paths: Iterable[Path]) -> list[Path]:
    """Return files or folders, the one that was changed last first."""
    return sorted(paths, key=lambda path: path.stat().st_mtime, reverse=True)


def newest(paths: Iterable[Path]) -> Path | None:
    """Return the file or folder that was changed last; None if there are none."""
    return next(iter(newest_first(paths)), None)


def trained_policies(outputs: str | Path) -> list[Path]:
    """Return last.pt of every training under a folder of outputs, the newest first."""
    return newest_first(as_path(outputs, "outputs").glob("train/**/checkpoints/last.pt"))


def read_json(path: Path, most: int = SMALL_JSON_BYTES) -> Any:
    """Return plain data from a JSON file; see `read_bytes` and `parse_json` for errors."""
    return parse_json(read_bytes(path, most), str(path))


def parse_json(content: bytes | str, where: str) -> Any:
    """Return plain data from JSON, whose numbers are finite.

    `where` is its name for messages.

    Raises:
        InputError: It is no such JSON.
    """
    try:
        return json.loads(content, parse_float=_finite, parse_constant=_finite)
    except (ValueError, RecursionError) as error:
        raise InputError(
            f"{where} is damaged or no plain JSON ({str(error)[:200]}); give another file"
        ) from None


def _finite(digits: str) -> float:
    value = float(digits)
    if not math.isfinite(value):
        raise ValueError(f"{digits[:20]} is no number, or too large")
    return value


def refuse_links(folder: Path, depth: int = 3) -> None:
    """Check that a folder has no links, so that reading and writing below it stays in it.

    `depth` levels of folders are searched.

    Raises:
        InputError: It contains a link or a device.
    """
    for entry in os.scandir(folder):
        is_folder = entry.is_dir(follow_symlinks=False)
        if not is_folder and not entry.is_file(follow_symlinks=False):
            raise InputError(
                f"{entry.path} is a link or a device; give a folder of regular files, or replace "
                "the link by what it points to"
            )
        if is_folder and depth > 1:
            refuse_links(Path(entry.path), depth - 1)


def to_file_name(name: str) -> str:
    """Return a name, such as a path, as the name of one file on any system."""
    return re.sub(r"[^A-Za-z0-9_-]+", "_", name).strip("_")[-60:] or "policy"


def write_atomically(path: Path, content: str | bytes) -> None:
    """Write a file as `write_all_atomically` does: readers get old or new content."""
    write_all_atomically({path: content})


def write_all_atomically(contents: Mapping[Path, str | bytes]) -> None:
    """Write several files: all contents are written before the first file is replaced.

    Raises:
        OSError: One can't be written; the error's `filename` is its path.
    """
    temporaries: dict[Path, Path] = {}
    now = next(iter(contents))
    try:
        for now, content in contents.items():
            if now.is_dir():
                raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
            temporary = now.with_name(f".{now.name}.{os.getpid()}")
            temporary.unlink(missing_ok=True)
            with temporary.open("xb") as file:  # refuses an existing link
                temporaries[temporary] = now
                file.write(content.encode() if isinstance(content, str) else content)
                file.flush()
                os.fsync(file.fileno())
        for temporary, now in temporaries.items():
            os.replace(temporary, now)
    except OSError as error:
        for temporary in temporaries:
            with contextlib.suppress(OSError):
                temporary.unlink(missing_ok=True)
        raise OSError(error.errno, error.strerror or str(error), str(now)) from error


@contextlib.contextmanager
def folder_lock(folder: Path, *, patience_s: float = 1.0) -> Iterator[None]:
    """Lock an existing folder; the system releases the lock when the process ends.

    `patience_s` are the seconds to try, longer than `is_locked` takes.

    Raises:
        InputError: Another process holds the lock.
    """
    with _open_lock(folder) as file:
        until = time.monotonic() + patience_s
        while not _try_lock(file.fileno()):
            if time.monotonic() > until:
                raise InputError(
                    f"another process is at work in {folder}; wait until it has ended or stop it"
                )
            time.sleep(0.05)
        yield


def is_locked(folder: Path) -> bool:
    """Return whether a process has locked the folder; holds the lock for a moment, to try it."""
    try:
        with _open_lock(folder) as file:
            return not _try_lock(file.fileno())
    except FileNotFoundError:
        return False


def _open_lock(folder: Path) -> Any:
    """Open the file of a folder's lock, but no link."""
    return open(
        folder / ".lock",
        "ab",
        opener=lambda path, flags: os.open(path, flags | os.O_NOFOLLOW | os.O_NONBLOCK, 0o644),
    )


def _try_lock(descriptor: int) -> bool:
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError as error:
        if error.errno not in _NO_LOCKS:
            raise
    return True
