"""Files that a scene names: read inside of its folder, and checked before anything decodes them."""

import contextlib
import hashlib
import io
import os
import struct
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Literal, NamedTuple

from PIL import Image

from drone_rl.utils import limits
from drone_rl.utils.errors import InputError
from drone_rl.utils.files import read_bytes

_MOST_CORNERS = 64
"""Of one face of an OBJ file; a face of n corners takes a time of n squared."""
_MOST_STL = 200_000
"""Triangles of an STL file that MuJoCo reads."""
_PNG = b"\x89PNG\r\n\x1a\n"
Kind = Literal["mesh", "texture", "hfield"]


class Asset(NamedTuple):
    """A file whose content is what its ending says."""

    ending: str
    content: bytes
    size: int
    """Triangles of a mesh, pixels of an image or points of a height field."""


class Folder:
    """The folder of a scene, from which its files are read, each one within limits."""

    def __init__(self, root: Path) -> None:
        """Take the folder's path."""
        self.root = root
        self.hash = hashlib.sha256()
        """Of the names and contents of all files that were read."""
        self.versions: dict[Path, tuple[int, int]] = {}
        """`version_of` the files that were read."""
        self._bytes = 0

    def find(self, places: Sequence[Path]) -> Path:
        """Return the first of some paths that exists.

        Raises:
            InputError: There is none, or it is outside of the folder, also by a link.
        """
        remedy = "does not exist; copy it there, or correct its name"
        for place in places:
            path = Path(os.path.normpath(place))
            with contextlib.suppress(OSError, RuntimeError, ValueError):  # loops of links, \0
                is_inside = path.is_relative_to(self.root)
                if not is_inside or not path.resolve().is_relative_to(self.root):
                    remedy = f"is outside of the scene's folder {self.root}; copy it there"
                elif path.exists():
                    return path
        raise InputError(f"the file {remedy}")

    def read(self, path: Path, most: int) -> bytes:
        """Return the content of a regular file.

        Raises:
            InputError: It is outside of the folder, not regular, or exceeds a limit.
        """
        version = version_of(path)
        content = read_bytes(path, most)
        self._bytes += len(content)
        self.versions[path] = version
        if self._bytes > limits.SCENE_BYTES or len(self.versions) > limits.SCENE_FILES:
            raise InputError(
                f"the scene's files are too many; give at most {limits.SCENE_FILES} of "
                f"{limits.SCENE_BYTES} bytes together"
            )
        name = os.path.relpath(path, self.root).encode()
        self.hash.update(b"%d %s %d " % (len(name), name, len(content)))
        self.hash.update(content)
        return content

    def asset(self, kind: Kind, path: Path) -> Asset:
        """Return a checked asset; see `read` for errors."""
        content = self.read(path, limits.SCENE_ASSET_BYTES)
        if kind == "mesh":
            return mesh(content, path)
        if kind == "hfield" and not _is_image(content):
            return _points(content, path)
        return image(content, path.name)


def version_of(path: Path) -> tuple[int, int]:
    """Return size and time of change of a file, (-1, -1) if there is none."""
    try:
        about = path.stat()
    except OSError:
        return -1, -1
    return about.st_size, about.st_mtime_ns


def mesh(content: bytes, path: Path) -> Asset:
    """Check a mesh's size by its header or lines; endings are those of MuJoCo's readers."""
    ending = path.suffix.lower()
    if ending == ".obj":
        return Asset(ending, content, _obj_size(content, path.name))
    if ending == ".stl":
        (count,) = struct.unpack_from("<I", content, 80) if len(content) >= 84 else (-1,)
        if len(content) != 84 + 50 * count:
            raise InputError(f"{path.name} is no binary STL, or damaged; save it as binary STL")
        if not 0 < count <= _MOST_STL:
            raise InputError(
                f"{path.name} has {count} triangles; give 1 to {_MOST_STL}, or save it as OBJ"
            )
        return Asset(ending, content, count)
    if ending == ".msh":
        numbers = struct.unpack_from("<4i", content) if len(content) >= 16 else (-1,) * 4
        vertices, normals, places, count = numbers
        length = 16 + 12 * vertices + 12 * normals + 8 * places + 12 * count
        if min(numbers) < 0 or len(content) != length:
            raise InputError(f"{path.name} is no MSH file, or damaged; save it as OBJ")
        return Asset(ending, content, max(count, vertices))
    raise InputError(f"{path.name} is no OBJ, STL or MSH file; save the mesh as OBJ")


def _obj_size(content: bytes, name: str) -> int:
    """Return the number of triangles, or of vertices, texture coordinates and normals if more."""
    triangles = points = 0
    for line in content.splitlines():
        start = line.lstrip()[:2]
        points += start[:1] == b"v"
        if start in (b"f ", b"f\t"):
            corners = len(line.split()) - 1
            if corners > _MOST_CORNERS:
                raise InputError(
                    f"{name} has a face of {corners} corners; give faces of at most {_MOST_CORNERS}"
                )
            triangles += corners - 2
    return max(triangles, points // 3)


def _is_image(content: bytes) -> bool:
    return content[:2] in (b"\x89P", b"\xff\xd8", b"BM")


def _points(content: bytes, path: Path) -> Asset:
    """Check MuJoCo's binary format of height fields: rows, columns, heights."""
    rows, columns = struct.unpack_from("<2i", content) if len(content) >= 8 else (-1, -1)
    if min(rows, columns) < 0 or len(content) != 8 + 4 * rows * columns:
        raise InputError(f"{path.name} is neither PNG nor MuJoCo's height field; save it as PNG")
    return Asset(".bin", content, rows * columns)


def image(content: bytes, name: str) -> Asset:
    """Return an image as PNG, of which MuJoCo reads no other kind; check its size in its header."""
    if content.startswith(_PNG) and content[12:16] == b"IHDR" and len(content) > 24:
        width, height = struct.unpack_from(">2I", content, 16)
        check_texels(width * height, name)
        return Asset(".png", content, width * height)
    try:
        with warnings.catch_warnings(action="ignore"):  # Pillow's, about large images
            opened = Image.open(io.BytesIO(content), formats=("JPEG", "BMP"))
        check_texels(opened.width * opened.height, name)
        converted = io.BytesIO()
        opened.convert("RGB").save(converted, "png", compress_level=1)
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{name} is no PNG, JPEG or BMP, or damaged; save it as PNG") from None
    return Asset(".png", converted.getvalue(), opened.width * opened.height)


def check_texels(count: int, name: str) -> None:
    """Raise an `InputError` if an image has too many pixels."""
    if count > limits.SCENE_TEXELS:
        raise InputError(
            f"{name} has {count} pixels; give a smaller image (all of a scene's together have at "
            f"most {limits.SCENE_TEXELS})"
        )
