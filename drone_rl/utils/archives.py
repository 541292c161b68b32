"""Safe reading of zip archives and arrays: every size is checked before memory is allocated."""

import io
import math
import re
import struct
import zipfile
import zlib
from collections.abc import Callable, Collection, Iterator
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from drone_rl.utils.errors import InputError
from drone_rl.utils.files import read_bytes
from drone_rl.utils.limits import (
    ARCHIVE_BYTES,
    ARRAYS_BYTES,
    ELEMENTS,
    MEMBERS,
    Allowance,
    check_shape,
)

T = TypeVar("T")

_CHUNK = 2**20
"""Bytes that are unpacked at a time."""
_LAST_CHARACTER = 0x10FFFF
_SURROGATES = 0xD800, 0xDFFF
"""Code points that are no characters."""
_LONGEST_HEADER = 1000
"""Characters of an array's header."""
_HEADER = re.compile(
    r"\{'descr': '(?P<dtype>[<>|](b1|[iu][1248]|f[248]|U\d{1,6}))', "
    r"'fortran_order': (?P<by_column>True|False), "
    r"'shape': \((?P<shape>(\d{1,13}, ?)*(\d{1,13})?)\), \}\s*"
)
"""NumPy's header."""
_DAMAGE = (
    *(zipfile.BadZipFile, zlib.error, struct.error),
    *(RuntimeError, EOFError, OSError, OverflowError, ValueError),
)
"""Errors of damaged archives."""
_ENTRY = b"PK\x01\x02"
"""Begin of each entry of an archive's directory."""


def read_members(
    content: bytes, where: str, *, most: int, methods: Collection[int] = (zipfile.ZIP_STORED,)
) -> Iterator[tuple[str, bytes]]:
    """Yield name and content of each file in an archive; `where` is its name for messages.

    `most` is the largest size of all files together, in bytes; `methods` are those of compression.

    Raises:
        InputError: The archive is damaged, or its directory exceeds a limit.
    """
    return _members(content, where, Allowance(most), methods, lambda file, size, _: file.read(size))


def read_arrays(
    path: Path,
    *,
    most: int = ARRAYS_BYTES,
    allowance: Allowance | None = None,
    wanted: Callable[[str], bool] = lambda _: True,
) -> dict[str, NDArray]:
    """Return the arrays of numbers and texts in an .npz file.

    `most` is the largest size of all arrays together, in bytes; `allowance`, shared with further
    files, replaces it. The file itself may have `most` bytes, but no limit below 256 MiB or above
    2 GiB is applied. `wanted` says by name which arrays to read.

    Raises:
        InputError: The file is unusable, or an array holds objects.
    """
    allowance = allowance or Allowance(most)
    content = read_bytes(path, max(ARCHIVE_BYTES, min(most, 2**31)))
    methods = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
    return {
        name.removesuffix(".npy"): array
        for name, array in _members(content, str(path), allowance, methods, _array, wanted)
    }


def read_array(path: Path, most: int = ARRAYS_BYTES) -> NDArray:
    """Return the array in an .npy file of at most `most` bytes; see `read_arrays`."""
    content = read_bytes(path, most)
    return _array(io.BytesIO(content), len(content), str(path))


def _members(
    content: bytes,
    where: str,
    allowance: Allowance,
    methods: Collection[int],
    read: Callable[[Any, int, str], T],
    wanted: Callable[[str], bool] = lambda _: True,
) -> Iterator[tuple[str, T]]:
    """Yield the name of each file and the result of `read(file, size, where)`."""
    if content.count(_ENTRY) > MEMBERS:
        raise InputError(f"{where} holds more than {MEMBERS} files")
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            members = archive.infolist()
            if len({member.filename for member in members}) < len(members):
                raise InputError(f"{where} holds two files of one name")
            members = [m for m in members if wanted(m.filename.removesuffix(".npy"))]
            allowance.take(sum(member.file_size for member in members), f"{where}, unpacked,")
            for member in members:
                if member.compress_type not in methods:
                    raise InputError(
                        f"{where} uses compression {member.compress_type}, which is not accepted"
                    )
                name = member.filename
                with archive.open(member) as file:
                    yield name, read(file, member.file_size, f"{where}: {name}")
    except InputError:
        raise
    except _DAMAGE as error:
        raise InputError(f"{where} is damaged or cut short ({error}); give another file") from None


def _array(file: Any, size: int, where: str) -> NDArray:
    """Read one array; NumPy would allocate whatever the header states."""
    begin = file.read(12)
    start = {b"\x93NUMPY\x01": 10, b"\x93NUMPY\x02": 12}.get(begin[:7], 0)
    length = int.from_bytes(begin[8:start], "little")
    read = min(length, _LONGEST_HEADER)
    text = begin[start:] + file.read(max(0, start + read - len(begin)))
    header = _HEADER.fullmatch(text.decode("latin1"))
    if start == 0 or length > read or header is None:
        raise InputError(f"{where} is no array of numbers or texts; it was not loaded")
    dtype = np.dtype(header["dtype"])
    shape = tuple(int(length) for length in header["shape"].split(",") if length.strip())
    count = math.prod(shape)
    if count * dtype.itemsize != size - start - length:
        raise InputError(f"{where} states {shape} of {dtype}, but holds another number of bytes")
    check_shape(shape, dtype.itemsize, ELEMENTS * dtype.itemsize, where)
    flat = np.empty(count, dtype)
    _fill(flat, file, where)
    return flat.reshape(shape, order="F" if header["by_column"] == "True" else "C")


def _fill(flat: NDArray, file: Any, where: str) -> None:
    """Read an array's numbers in chunks, so that they are never in memory twice."""
    buffer = flat.view(np.uint8)
    for begin in range(0, len(buffer), _CHUNK):
        piece = file.read(min(_CHUNK, len(buffer) - begin))
        if len(piece) < min(_CHUNK, len(buffer) - begin):
            raise InputError(f"{where} is cut short")
        buffer[begin : begin + len(piece)] = np.frombuffer(piece, np.uint8)
    if flat.dtype.kind == "U" and len(flat):
        codes = flat.view(flat.dtype.newbyteorder("=")).view(np.uint32)
        codes = codes.byteswap() if flat.dtype.byteorder == ">" else codes
        low, high = _SURROGATES
        if codes.max() > _LAST_CHARACTER or ((codes >= low) & (codes <= high)).any():
            raise InputError(f"{where} holds numbers that are no characters")
