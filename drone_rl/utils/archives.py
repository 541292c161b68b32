"""Read NumPy's files of numbers and texts: no objects, and no more bytes than a limit."""

import contextlib
import io
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drone_rl.utils.errors import InputError
from drone_rl.utils.files import read_bytes
from drone_rl.utils.limits import ARRAYS_BYTES


def read_arrays(path: Path, most: int = ARRAYS_BYTES) -> dict[str, NDArray]:
    """Return the arrays in an .npz file of at most `most` bytes, unpacked, too.

    Raises:
        InputError: The file is unusable, or an array holds objects.
    """
    content = read_bytes(path, most)
    with _damage_as_input_error(path):
        check_unpacked_size(content, str(path), most)
        file: Any = np.load(io.BytesIO(content), allow_pickle=False)
        with file:
            return {name: file[name] for name in file.files}


def read_array(path: Path, most: int = ARRAYS_BYTES) -> NDArray:
    """Return the array in an .npy file of at most `most` bytes; see `read_arrays`."""
    content = read_bytes(path, most)
    with _damage_as_input_error(path):
        return np.lib.format.read_array(io.BytesIO(content), allow_pickle=False)


def check_unpacked_size(content: bytes, where: str, most: int) -> None:
    """Raise an `InputError` if the files in an archive have more than `most` bytes together."""
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        size = sum(member.file_size for member in archive.infolist())
    if size > most:
        raise InputError(f"{where} has {size} bytes, unpacked; files of its kind have {most}")


@contextlib.contextmanager
def _damage_as_input_error(path: Path) -> Iterator[None]:
    try:
        yield
    except InputError:
        raise
    except Exception as error:  # whatever NumPy and zipfile raise for damaged content
        reason = " ".join(str(error).split())[:200]
        raise InputError(
            f"{path} is damaged, or holds more than numbers and texts ({reason}); give another file"
        ) from None
