"""Definition of a case of a malicious file, and helpers that create such files."""

import os
import zipfile
import zlib
from collections.abc import Callable, Mapping
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

Case = tuple[str, list[str], str]
"""Name, arguments of `drone-rl`, and what would go wrong if the file were accepted."""
Make = Callable[[Path], Any]
"""Creates a file or anything else at a path."""
NOTED = "noted_"
"""Prefix of cases that are not refused: the report names the damaged run."""
_ZEROS = bytes(2**20)


def put(path: Path, content: bytes | Make) -> None:
    """Write bytes to a path, or create something else there."""
    if isinstance(content, bytes):
        path.write_bytes(content)
    else:
        content(path)


def sparse(path: Path) -> None:
    """Create a file of a terabyte that occupies no disk space."""
    with path.open("wb") as file:
        file.truncate(2**40)


def nested(levels: int) -> list[Any]:
    """Return lists within lists."""
    return [nested(levels - 1)] if levels else []


def zipped(members: Mapping[str, bytes], method: int = zipfile.ZIP_STORED) -> bytes:
    """Return the content of a zip archive."""
    file = BytesIO()
    with zipfile.ZipFile(file, "w", method) as archive:
        for name, content in members.items():
            archive.writestr(name, content)
    return file.getvalue()


def zipped_zeros(name: str, head: bytes, zeros: int) -> bytes:
    """Return a compressed zip archive of one member: `head`, then as many zero bytes.

    All blocks of zeros share one compressed block, so a GiB takes no seconds.
    """
    packer = zlib.compressobj(wbits=-zlib.MAX_WBITS)
    packed = packer.compress(head) + packer.flush(zlib.Z_FULL_FLUSH)
    block = packer.compress(_ZEROS) + packer.flush(zlib.Z_FULL_FLUSH)
    blocks, rest = divmod(zeros, len(_ZEROS))
    packed += block * blocks + packer.compress(bytes(rest)) + packer.flush()
    checksum = zlib.crc32(head)
    for part in (*[_ZEROS] * blocks, bytes(rest)):
        checksum = zlib.crc32(part, checksum)
    file = BytesIO()
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr(name, packed)
        (member,) = archive.infolist()
        member.compress_type, member.CRC = zipfile.ZIP_DEFLATED, checksum
        member.file_size = len(head) + zeros
        file.seek(0)
        file.write(member.FileHeader())
    return file.getvalue()


def npz(arrays: Mapping[str, np.ndarray]) -> bytes:
    """Return the content of a compressed file of arrays."""
    file = BytesIO()
    # numpy annotates every keyword as allow_pickle
    np.savez_compressed(file, **arrays)  # pyright: ignore[reportArgumentType]
    return file.getvalue()


NOT_REGULAR: Mapping[str, Make] = {
    "empty": Path.touch,
    "folder": Path.mkdir,
    "pipe": os.mkfifo,
    "zeros": lambda path: path.symlink_to("/dev/zero"),
    "loop": lambda path: path.symlink_to(path),
    "sparse": sparse,
}
"""Objects that can be where a regular file is expected."""
