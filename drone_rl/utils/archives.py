"""Zip archives and the arrays in them, read without trust: every size is known beforehand."""

import io
import math
import re
import struct
import zipfile
import zlib
from collections.abc import Collection, Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from drone_rl.utils.errors import InputError
from drone_rl.utils.files import read_bytes

MOST_MEMBERS = 10_000
"""Files in one archive."""
_HEADER = re.compile(
    r"\{'descr': '(?P<dtype>[<>|](b1|[iu][1248]|f[248]|U\d{1,6}))', "
    r"'fortran_order': (?P<by_column>True|False), "
    r"'shape': \((?P<shape>(\d{1,13}, ?)*(\d{1,13})?)\), \}\s*"
)
"""What NumPy writes before an array's numbers."""
_DAMAGE = (
    *(zipfile.BadZipFile, zlib.error, struct.error),
    *(RuntimeError, EOFError, OSError, ValueError),
)
"""What the reading of a damaged archive raises."""
_ENTRY = b"PK\x01\x02"
"""What each entry of an archive's directory begins with."""


def read_members(
    content: bytes, where: str, *, most: int, methods: Collection[int] = (zipfile.ZIP_STORED,)
) -> Iterator[tuple[str, bytes]]:
    """The files in an archive, one after another.

    Args:
        content: Of the archive.
        where: Its name, for people.
        most: Bytes that all of them together may have once unpacked.
        methods: Of compression, that are accepted.

    Yields:
        Name and content.

    Raises:
        InputError: The archive is damaged, or its directory tells of more than is allowed.
    """
    remedy = "the file was damaged or cut short"
    if content.count(_ENTRY) > MOST_MEMBERS:
        raise InputError(f"{where} holds more than {MOST_MEMBERS} files")
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            members = archive.infolist()
            if sum(member.file_size for member in members) > most:
                raise InputError(f"{where} would unpack to more than {most} bytes")
            if len({member.filename for member in members}) < len(members):
                raise InputError(f"{where} holds two files of one name")
            for member in members:
                if member.compress_type not in methods:
                    raise InputError(f"{where} is compressed in a way that is not accepted")
                yield member.filename, archive.read(member)
    except InputError:
        raise
    except _DAMAGE as error:
        raise InputError(f"{where} is no whole archive ({error}); {remedy}") from None


def read_arrays(path: Path, *, most: int = 2**29) -> dict[str, NDArray]:
    """The arrays of an .npz file: numbers and texts only, each as large as its bytes.

    Args:
        path: Of the file.
        most: Bytes that all arrays together may have.

    Raises:
        InputError: The file is unusable, or an array holds objects.
    """
    content = read_bytes(path, min(most, 2**28))
    methods = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
    return {
        name.removesuffix(".npy"): _array(data, f"{path}: {name}")
        for name, data in read_members(content, str(path), most=most, methods=methods)
    }


def _array(content: bytes, where: str) -> NDArray:
    """One array in NumPy's own format; NumPy itself would allocate what the header asks for."""
    start = {1: 10, 2: 12}.get(content[6] if content[:6] == b"\x93NUMPY" else 0, 0)
    end = start + int.from_bytes(content[8:start], "little")
    header = _HEADER.fullmatch(content[start:end].decode("latin1"))
    if start == 0 or header is None:
        raise InputError(f"{where} is no array of numbers or texts; it was not loaded")
    dtype = np.dtype(header["dtype"])
    shape = tuple(int(length) for length in header["shape"].split(",") if length.strip())
    count = math.prod(shape)
    if count * dtype.itemsize != len(content) - end:
        raise InputError(f"{where} is said to be {shape} of {dtype}, which its bytes are not")
    if len(shape) > 8 or dtype.itemsize == 0:
        raise InputError(f"{where} has {len(shape)} dimensions of {dtype}; it was not loaded")
    flat = np.frombuffer(content[end:], dtype) if count else np.empty(0, dtype)
    return flat.reshape(shape, order="F" if header["by_column"] == "True" else "C").copy()
