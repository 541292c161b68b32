"""Checkpoints that are whole or not there, and that can't run code when loaded."""

import contextlib
import os
import pickle
import tempfile
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import torch
from torch import nn

from drone_rl.utils.errors import InputError

FORMAT = "drone_rl checkpoint"
FORMAT_VERSION = 1


def save_checkpoint(path: str | Path, state: Mapping[str, Any]) -> None:
    """Writes a checkpoint atomically: whatever fails, the previous file stays as it was.

    Args:
        path: Where to; its folder must exist.
        state: Tensors and plain values.

    Raises:
        InputError: The folder can't be written or the disk is full.
    """
    path = Path(path)
    temporary: str | None = None
    try:
        with tempfile.NamedTemporaryFile(
            dir=path.parent, prefix=f".{path.name}.", delete=False
        ) as file:
            temporary = file.name
            torch.save({"format": FORMAT, "format_version": FORMAT_VERSION, **state}, file)
            file.flush()
            os.fsync(file.fileno())
        os.replace(temporary, path)
    except (OSError, RuntimeError) as error:
        if temporary is not None:
            with contextlib.suppress(OSError):
                os.unlink(temporary)
        reason = getattr(error, "strerror", None) or str(error).splitlines()[0]
        raise InputError(
            f"checkpoint {path} could not be written ({reason}); free some space or choose "
            "another folder with hydra.run.dir=..., the previous checkpoint is intact"
        ) from error


def load_checkpoint(path: str | Path) -> dict[str, Any]:
    """Reads a checkpoint onto the CPU, refusing anything that could run code.

    Raises:
        InputError: The file is missing, damaged, holds code, or is not a checkpoint of ours.
    """
    path = Path(path)
    if not path.is_file():
        raise InputError(f"checkpoint {path} does not exist; give the path of a .pt file")
    try:
        state = torch.load(path, weights_only=True, map_location="cpu")
    except pickle.UnpicklingError as error:
        raise InputError(
            f"checkpoint {path} holds more than tensors and plain values and was not loaded, "
            "since it could run code; use a checkpoint that drone-rl train wrote"
        ) from error
    except (RuntimeError, EOFError, OSError, ValueError, zipfile.BadZipFile, KeyError) as error:
        raise InputError(
            f"checkpoint {path} is damaged or cut short; use another one of that run "
            "(last.pt, best.pt) or train again"
        ) from error
    if not isinstance(state, dict) or state.get("format") != FORMAT:
        raise InputError(f"{path} is not a drone_rl checkpoint; use one that drone-rl train wrote")
    if state.get("format_version") != FORMAT_VERSION:
        raise InputError(
            f"checkpoint {path} has format version {state.get('format_version')}, this program "
            f"reads {FORMAT_VERSION}; use the version of drone_rl that wrote it"
        )
    return state


def load_policy(network: nn.Module, state: Mapping[str, torch.Tensor]) -> None:
    """Loads parameters into a network of the same architecture.

    Raises:
        InputError: The architectures differ; the first difference is named.
    """
    own = network.state_dict()
    remedy = "choose the policy and camera that the checkpoint was trained with"
    for name in [*own, *(name for name in state if name not in own)]:
        here = tuple(own[name].shape) if name in own else "absent"
        there = tuple(state[name].shape) if name in state else "absent"
        if here != there:
            raise InputError(
                f"the checkpoint's policy differs from this one: {name} is {there} there and "
                f"{here} here; {remedy}"
            )
    network.load_state_dict(state)
