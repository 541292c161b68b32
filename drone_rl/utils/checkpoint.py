"""Checkpoints: written atomically, read without executing code or trusting sizes.

`torch.load(weights_only=True)` runs no code, but it allocates what a file requests, trusts the
sizes of storages and supports types that a checkpoint never contains. The reader here supports only
the pickle instructions of checkpoints and builds tensors from the bytes that are present.
"""

import collections
import contextlib
import io
import math
import os
import pickle
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar, NoReturn

import torch
from torch import Tensor

from drone_rl.utils.archives import read_members
from drone_rl.utils.errors import InputError
from drone_rl.utils.files import read_bytes, temporary_of
from drone_rl.utils.limits import CHECKPOINT_BYTES, DIMENSIONS, PICKLED_BYTES
from drone_rl.utils.schema import as_mapping, shown

_MEMBER = re.compile(r"[^/]+/(data\.pkl|data/\d+|byteorder|version|\.[\w/.]+)")
_DTYPES = {
    "FloatStorage": torch.float32,
    "DoubleStorage": torch.float64,
    "HalfStorage": torch.float16,
    "BFloat16Storage": torch.bfloat16,
    "LongStorage": torch.int64,
    "IntStorage": torch.int32,
    "ShortStorage": torch.int16,
    "CharStorage": torch.int8,
    "ByteStorage": torch.uint8,
    "BoolStorage": torch.bool,
    "ComplexFloatStorage": torch.complex64,
    "ComplexDoubleStorage": torch.complex128,
}
_DISPATCH: dict[int, Any] = pickle._Unpickler.dispatch
"""Python's own instructions, by code."""
_INSTRUCTIONS = {
    name: getattr(pickle, name)[0]
    for name in (
        *("PROTO", "STOP", "MARK", "NONE", "NEWTRUE", "NEWFALSE"),
        *("BININT", "BININT1", "BININT2", "LONG1", "BINFLOAT", "BINUNICODE"),
        *("EMPTY_TUPLE", "TUPLE", "TUPLE1", "TUPLE2", "TUPLE3"),
        *("EMPTY_LIST", "APPEND", "APPENDS", "EMPTY_DICT", "SETITEM", "SETITEMS"),
        *("BINPUT", "LONG_BINPUT", "BINGET", "LONG_BINGET"),
        *("GLOBAL", "REDUCE", "BUILD", "BINPERSID"),
    )
}


_ZIP = b"PK"
"""First bytes of a checkpoint, which is a ZIP archive."""
_FORMATS = {
    b"version https://git-lfs": "a Git LFS pointer; replace it by the file with git lfs pull",
    rb".{8}\{": "a safetensors file; name it NAME.safetensors",
    _ZIP: "an archive, as checkpoints are; name it NAME.pt",
    rb"\x08.[\x12\x1a:B]": "an ONNX model; give the policy's .pt or .safetensors file",
}
"""What a misnamed file is, with a remedy, by a pattern of its first bytes."""


def other_format(content: bytes) -> str | None:
    """Return what a file with this content is, with a remedy; None if that is not known."""
    found = (text for start, text in _FORMATS.items() if re.match(start, content, re.DOTALL))
    return next(found, None)


class DamagedError(ValueError):
    """The file is damaged or cut short."""


class ForeignError(ValueError):
    """The file contains more than tensors and plain values."""


def unpickle(content: bytes, where: str) -> Any:
    """Return the object that `torch.save` wrote, on the CPU; `where` is the file's name.

    Raises:
        InputError: The archive is damaged or exceeds a limit.
        DamagedError: Its instructions or storages are damaged.
        ForeignError: It contains more than tensors and plain values.
    """
    members: dict[str, bytes] = {}
    for name, data in read_members(content, where, most=CHECKPOINT_BYTES):
        if not _MEMBER.fullmatch(name):
            raise ForeignError(f"a file {name[:80]!r}")
        members[name.partition("/")[2]] = data
    program = members.get("data.pkl")
    if program is None or members.get("byteorder", b"little") != b"little":
        raise DamagedError("it has no data.pkl of this byte order")
    if len(program) > PICKLED_BYTES:
        raise ForeignError("more values than a checkpoint has")
    reader = _Unpickler(program, members)
    members.clear()
    try:
        return reader.load()
    except (DamagedError, ForeignError):
        raise
    except _DAMAGE as error:
        raise DamagedError(type(error).__name__) from None


_DAMAGE = (
    *(pickle.UnpicklingError, EOFError, ValueError, TypeError, LookupError, AttributeError),
    *(RuntimeError, OverflowError, RecursionError),
)
"""Errors of damaged instructions."""


def _build(storage: Any, offset: Any, size: Any, stride: Any, *_: Any) -> Tensor:
    """Build a tensor from a storage, in place of torch's function."""
    numbers = (offset, *size, *stride)
    if not isinstance(storage, Tensor) or any(type(n) is not int or n < 0 for n in numbers):
        raise DamagedError("a tensor without a storage")
    extent = offset + sum((n - 1) * step for n, step in zip(size, stride, strict=True)) + 1
    count = math.prod(size)
    if len(size) > DIMENSIONS or count > len(storage) or (count and extent > len(storage)):
        raise DamagedError("a tensor is larger than its storage")
    return storage.as_strided(size, stride, offset)


class _Unpickler(pickle._Unpickler):
    """Python's unpickler, restricted to the instructions of checkpoints."""

    dispatch: ClassVar[dict] = {code: _DISPATCH[code] for code in _INSTRUCTIONS.values()}

    def __init__(self, program: bytes, members: Mapping[str, bytes]) -> None:
        super().__init__(io.BytesIO(program))
        self._members = dict(members)
        self._storages: dict[str, Tensor] = {}

    def load(self) -> Any:
        """Run the instructions."""
        used = _Watched(self.dispatch)
        self.dispatch = used  # pyright: ignore[reportAttributeAccessIssue] (of this load only)
        return super().load()

    def find_class(self, module: str, name: str) -> Any:
        """Return one of the three kinds of globals in a checkpoint."""
        if (module, name) == ("torch._utils", "_rebuild_tensor_v2"):
            return _build
        if (module, name) == ("collections", "OrderedDict"):
            return lambda: collections.OrderedDict()  # it has no attributes of the class
        if module == "torch" and name in _DTYPES:
            return _DTYPES[name]
        raise ForeignError(f"{module}.{name}"[:80])

    def persistent_load(self, pid: Any) -> Tensor:
        """Return a storage whose length matches its bytes."""
        kind, dtype, key, _, length = pid
        if kind != "storage" or not isinstance(dtype, torch.dtype) or not isinstance(key, str):
            raise ForeignError("a reference to something else than a storage")
        if key not in self._storages:  # its bytes are there once: as a member, then as a tensor
            content = self._members.pop(f"data/{key}")
            if length * dtype.itemsize != len(content):
                raise DamagedError("a storage is not as long as it says")
            empty = torch.empty(0, dtype=dtype)
            numbers = torch.frombuffer(bytearray(content), dtype=dtype) if content else empty
            self._storages[key] = numbers
        storage = self._storages[key]
        if storage.dtype != dtype or length != len(storage):
            raise DamagedError("one storage is named with two types or lengths")
        return storage

    def _ignore_state(self) -> None:
        """Drop the versions of layers."""
        self.stack.pop()  # pyright: ignore[reportAttributeAccessIssue] (not in typeshed)

    def _set_item(self) -> None:
        self._check_names(self.stack[-2:-1])  # pyright: ignore[reportAttributeAccessIssue]
        _DISPATCH[_INSTRUCTIONS["SETITEM"]](self)

    def _set_items(self) -> None:
        self._check_names(self.stack[::2])  # pyright: ignore[reportAttributeAccessIssue]
        _DISPATCH[_INSTRUCTIONS["SETITEMS"]](self)

    def _check_names(self, names: Sequence[Any]) -> None:
        """Refuse tuples: Python crashes when it hashes a deeply nested one."""
        if any(isinstance(name, tuple) for name in names):
            raise ForeignError("a tuple as a name")

    dispatch[_INSTRUCTIONS["BUILD"]] = _ignore_state
    dispatch[_INSTRUCTIONS["SETITEM"]] = _set_item
    dispatch[_INSTRUCTIONS["SETITEMS"]] = _set_items


class _Watched(dict):
    """Instructions; an unknown one means that the file is no checkpoint."""

    def __missing__(self, code: int) -> NoReturn:
        raise ForeignError(f"instruction {code}")


FORMAT = "drone_rl checkpoint"
FORMAT_VERSION = 2


def save_checkpoint(path: str | Path, state: Mapping[str, Any]) -> None:
    """Write a checkpoint of tensors and plain values; a failure leaves the previous file intact.

    Raises:
        InputError: The folder can't be written or the disk is full.
    """
    path = Path(path)
    temporary = temporary_of(path)
    try:
        temporary.unlink(missing_ok=True)
        with temporary.open("xb") as file:
            torch.save({"format": FORMAT, "format_version": FORMAT_VERSION, **state}, file)
            file.flush()
            os.fsync(file.fileno())
        os.replace(temporary, path)
    except (OSError, RuntimeError) as error:
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)
        reason = _reason(error)
        before = "the previous checkpoint is intact" if path.is_file() else "there is none yet"
        raise InputError(
            f"checkpoint {path} could not be written ({reason}); free some space or choose another "
            f"folder (in Python folder=..., else hydra.run.dir=...); {before}"
        ) from error


def _reason(error: BaseException) -> str:
    """Return the system's reason, which PyTorch hides behind its own error."""
    cause: BaseException | None = error
    while cause is not None:
        if isinstance(cause, OSError) and cause.strerror:
            return cause.strerror
        cause = cause.__cause__ or cause.__context__
    return (str(error) or type(error).__name__).splitlines()[0]


def _refuse(content: bytes, path: Path) -> None:
    """Raise an `InputError` for a file of another known format, or whose suffix is not .pt."""
    if other := other_format(content):
        raise InputError(f"{path} is {other}")
    if path.suffix != ".pt":
        raise InputError(
            f"{path} is no policy file; give a .pt or .safetensors file or a run's folder"
        )


def load_checkpoint(path: str | Path) -> dict[str, Any]:
    """Read tensors and plain values from a checkpoint onto the CPU.

    Raises:
        InputError: The file is missing, damaged, holds code, or is not a checkpoint of ours.
    """
    path = Path(path)
    if not os.path.exists(path):  # `Path.exists` raises an error for a name that is too long
        raise InputError(f"checkpoint {path} does not exist; give a run's folder or a .pt file")
    content = read_bytes(path, CHECKPOINT_BYTES)
    if not content.startswith(_ZIP):
        _refuse(content, path)
    try:
        state = unpickle(content, f"checkpoint {path}")
    except InputError:
        raise
    except ForeignError as error:
        raise InputError(
            f"checkpoint {path} holds more than tensors and plain values ({error}) and was not "
            "loaded, since it could run code; use a checkpoint that drone-rl train wrote"
        ) from None
    except ValueError as error:
        raise InputError(
            f"checkpoint {path} is damaged or cut short ({error}); use another one of that run "
            "(last.pt, best.pt) or train again"
        ) from None
    if not isinstance(state, dict) or state.get("format") != FORMAT:
        raise InputError(f"{path} is not a drone_rl checkpoint; use one that drone-rl train wrote")
    version = state.get("format_version")
    if type(version) is not int or version != FORMAT_VERSION:
        raise InputError(
            f"checkpoint {path} has format version {shown(version)}, this program reads "
            f"{FORMAT_VERSION}; use the version of drone_rl that wrote it"
        )
    return state


def check_weights(weights: Any, expected: Mapping[str, Tensor]) -> dict[str, Tensor]:
    """Return the weights of a file if they are finite and match the expected names and shapes.

    `expected` is the network's `state_dict`, which may be on the meta device.

    Raises:
        InputError: They differ; the message names the first difference.
    """
    found = dict(as_mapping(weights, "the policy's weights"))
    for name in [*expected, *(name for name in found if name not in expected)]:
        there, here = _kind(found.get(name)), _kind(expected.get(name))
        if there != here:
            raise InputError(
                "the saved weights are not those of the described policy: "
                f"{shown(name)} is {there} in the file and {here} by the description; choose the "
                "policy and camera of the training"
            )
    for name, value in found.items():
        if value.is_floating_point() and not bool(torch.isfinite(value).all()):
            raise InputError(
                f"the weights {name} hold NaN or infinity; use a checkpoint from before that"
            )
    return found


def _kind(value: Any) -> str:
    if value is None:
        return "absent"
    if not isinstance(value, Tensor):
        return f"no tensor ({type(value).__name__})"
    kind = "" if value.dtype == torch.float32 else f" of {value.dtype}".replace("torch.", "")
    return f"{tuple(value.shape)}{kind}"
