"""Checkpoints that are whole or not there, and that can't run code when loaded."""

import contextlib
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import torch

from drone_rl.utils.errors import InputError
from drone_rl.utils.files import read_bytes, temporary_of
from drone_rl.utils.former_names import with_present_names
from drone_rl.utils.limits import CHECKPOINT_BYTES
from drone_rl.utils.schema import shown
from drone_rl.utils.unpickling import ForeignError, unpickle

FORMAT = "drone_rl checkpoint"
FORMAT_VERSION = 2
"""With a description of the policy; version 1 has the training's settings alone."""
READABLE = (1, FORMAT_VERSION)


def save_checkpoint(path: str | Path, state: Mapping[str, Any]) -> None:
    """Writes a checkpoint atomically: whatever fails, the previous file stays as it was.

    Args:
        path: Where to; its folder must exist.
        state: Tensors and plain values.

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
            f"checkpoint {path} could not be written ({reason}); free some space or choose "
            f"another folder with hydra.run.dir=..., {before}"
        ) from error


def _reason(error: BaseException) -> str:
    """What the system said; PyTorch hides it behind an error of its own."""
    cause: BaseException | None = error
    while cause is not None:
        if isinstance(cause, OSError) and cause.strerror:
            return cause.strerror
        cause = cause.__cause__ or cause.__context__
    return (str(error) or type(error).__name__).splitlines()[0]


def load_checkpoint(path: str | Path) -> dict[str, Any]:
    """Reads a checkpoint onto the CPU: tensors and plain values, whatever is in the file.

    Raises:
        InputError: The file is missing, damaged, holds code, or is not a checkpoint of ours.
    """
    path = Path(path)
    if not path.exists():
        raise InputError(f"checkpoint {path} does not exist; give the path of a .pt file")
    content = read_bytes(path, CHECKPOINT_BYTES)
    try:
        state = unpickle(content, f"checkpoint {path}")
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
    if type(version) is not int or version not in READABLE:
        raise InputError(
            f"checkpoint {path} has format version {shown(version)}, this program reads "
            f"{' and '.join(map(str, READABLE))}; use the version of drone_rl that wrote it"
        )
    if isinstance(state.get("progress"), Mapping):
        state["progress"] = with_present_names(state["progress"])
    return state
