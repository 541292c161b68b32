"""Checkpoints: tensors and plain values, written atomically, read without executing code."""

import io
import os
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from drone_rl.utils.archives import check_unpacked_size
from drone_rl.utils.errors import InputError
from drone_rl.utils.files import read_bytes, write_atomically
from drone_rl.utils.limits import CHECKPOINT_BYTES
from drone_rl.utils.schema import as_mapping, shown

FORMAT = "drone_rl checkpoint"
FORMAT_VERSION = 4
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
    descriptions = (text for start, text in _FORMATS.items() if re.match(start, content, re.DOTALL))
    return next(descriptions, None)


def save_checkpoint(path: str | Path, state: Mapping[str, Any]) -> None:
    """Write a checkpoint of tensors and plain values; a failure leaves the previous file intact.

    Raises:
        InputError: The folder can't be written or the disk is full.
    """
    path = Path(path)
    content = io.BytesIO()
    torch.save({"format": FORMAT, "format_version": FORMAT_VERSION, **state}, content)
    try:
        write_atomically(path, content.getvalue())
    except OSError as error:
        before = "the previous checkpoint is intact" if path.is_file() else "there is none yet"
        raise InputError(
            f"checkpoint {path} could not be written ({error.strerror}); free some space or choose "
            f"another folder (in Python folder=..., else hydra.run.dir=...); {before}"
        ) from error


def load_checkpoint(path: str | Path) -> dict[str, Any]:
    """Read tensors and plain values from a checkpoint onto the CPU.

    Raises:
        InputError: The file is missing, damaged, holds code, or is not a checkpoint of ours.
    """
    state = read_any_version(Path(path))
    version = state.get("format_version")
    if type(version) is not int or version != FORMAT_VERSION:
        raise InputError(
            f"checkpoint {path} has format version {shown(version)}, this program reads "
            f"{FORMAT_VERSION}; convert one of an older version, or the folder of its run, with "
            f"drone-rl convert {path}"
        )
    return state


def read_any_version(path: Path) -> dict[str, Any]:
    """Read a checkpoint, see `load_checkpoint`, whichever version of drone_rl wrote it."""
    if not os.path.exists(path):  # `Path.exists` raises an error for a name that is too long
        raise InputError(f"checkpoint {path} does not exist; give a run's folder or a .pt file")
    content = read_bytes(path, CHECKPOINT_BYTES)
    if not content.startswith(_ZIP):
        if other := other_format(content):
            raise InputError(f"{path} is {other}")
        if path.suffix != ".pt":
            raise InputError(
                f"{path} is no policy file; give a .pt or .safetensors file or a run's folder"
            )
    try:
        check_unpacked_size(content, f"checkpoint {path}", CHECKPOINT_BYTES)
        state = torch.load(io.BytesIO(content), map_location="cpu", weights_only=True)
    except InputError:
        raise
    except Exception as error:  # whatever PyTorch and zipfile raise for damaged content
        reason = " ".join(str(error).split())[:200]
        raise InputError(
            f"checkpoint {path} is damaged, or holds more than tensors and plain values, which "
            f"could run code ({reason}); use one that drone-rl train wrote (last.pt, best.pt)"
        ) from None
    if not isinstance(state, dict) or state.get("format") != FORMAT:
        raise InputError(f"{path} is not a drone_rl checkpoint; use one that drone-rl train wrote")
    return state


def check_weights(weights: Any, expected: Mapping[str, Tensor]) -> dict[str, Tensor]:
    """Return the weights of a file if they are finite and match the expected names and shapes.

    `expected` is the network's `state_dict`, which may be on the meta device.

    Raises:
        InputError: They differ; the message names the first difference.
    """
    saved = dict(as_mapping(weights, "the policy's weights"))
    for name in [*expected, *(name for name in saved if name not in expected)]:
        there, here = _kind(saved.get(name)), _kind(expected.get(name))
        if there != here:
            raise InputError(
                "the saved weights are not those of the described policy: "
                f"{shown(name)} is {there} in the file and {here} by the description; choose the "
                "policy and camera of the training"
            )
    for name, value in saved.items():
        if value.is_floating_point() and not bool(torch.isfinite(value).all()):
            raise InputError(
                f"the weights {name} hold NaN or infinity; use a checkpoint from before that"
            )
    return saved


def _kind(value: Any) -> str:
    if value is None:
        return "absent"
    if not isinstance(value, Tensor):
        return f"no tensor ({type(value).__name__})"
    kind = "" if value.dtype == torch.float32 else f" of {value.dtype}".replace("torch.", "")
    return f"{tuple(value.shape)}{kind}"
