"""Convert policy files of older versions to the present layout.

Only this module knows the names that settings and figures had in older versions. The training
command in a file is left as it is, since it repeats the training at the revision in the file.
"""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from safetensors.torch import load

from drone_rl.policies.zoo.files import (
    ABOUT,
    checked_state,
    exported_bytes,
    metadata_of,
    parse_exported,
    read_exported_bytes,
)
from drone_rl.utils.checkpoint import FORMAT_VERSION, read_any_version, save_checkpoint
from drone_rl.utils.errors import InputError
from drone_rl.utils.files import write_atomically
from drone_rl.utils.schema import as_mapping

_FIGURES = {"running_cubes": "running_reward"}
"""Names of figures until version 0.1, and the present names."""
_OVERRIDES = (
    (r"^(\+{0,2}|~)optimiser(?=[.=@]|$)", r"\1optimizer"),
    (r"^(\+{0,2}|~)policy(?=[.=@]|$)", r"\1network"),
    (r"^(\+{0,2}|~)trainer\.minibatch_frames(?==|$)", r"\1trainer.chunk_frames"),
    (r"^(collector=.*?)\bthreads\b", r"\1episodes"),
    (r"^(scheduler=.*?)\bnone\b", r"\1constant"),
    (r"^(returns=.*?)\bstandardised\b", r"\1standardized"),
    (r"^(returns=.*?)\bbatch_normalised\b", r"\1batch_normalized"),
    (r"^(appearance=.*?)\brandomised\b", r"\1randomized"),
)
"""Patterns of the names of settings and choices until version 0.1, and the present names."""


def convert_policy(path: Path, output: Path | None = None) -> Path:
    """Write a policy file of an older version in the present layout, and return the new path.

    Args:
        path: A .safetensors file of `drone-rl export`, or a checkpoint (.pt).
        output: The new file; by default NAME_converted next to the old one.

    Raises:
        InputError: The file is unusable or has the present layout, or the output exists.
    """
    output = output or path.with_stem(f"{path.stem}_converted")
    if output.exists() or output.suffix != path.suffix:
        fault = "exists" if output.exists() else f"does not end in {path.suffix}"
        raise InputError(f"output={output} {fault}; give another path")
    try:
        if path.suffix == ".safetensors":
            _write(output, _converted_export(read_exported_bytes(path)))
        else:
            save_checkpoint(output, _converted_state(read_any_version(path)))
    except InputError as error:
        raise InputError(
            f"policy {path} can't be converted ({error}); files from before version 0.1 must be "
            "trained again"
        ) from None
    return output


def _converted_export(content: bytes) -> bytes:
    description, about = metadata_of(content)
    present = {k: v for k, v in as_mapping(about, "about").items() if k in ABOUT.fields}
    present["progress"] = _with_present_figures(present.get("progress"))
    if present == about:
        raise InputError("it has the present layout; use it as it is")
    converted = exported_bytes(load(content), description, present)
    parse_exported(converted)
    return converted


def _converted_state(state: Mapping[str, Any]) -> dict[str, Any]:
    if state.get("format_version") == FORMAT_VERSION:
        raise InputError("it has the present layout; use it as it is")
    present = {
        _with_present_names(name): value for name, value in state.items() if name != "policy"
    }
    present["policy"] = state.get("policy")
    present["progress"] = _with_present_figures(state.get("progress"))
    present["config"] = _with_present_settings(state.get("config"))
    for name in ("format", "format_version"):
        del present[name]
    return checked_state(present)


def _with_present_figures(progress: Any) -> dict[str, Any]:
    figures = as_mapping(progress, "progress")
    return {_FIGURES.get(name, name): value for name, value in figures.items()}


def _with_present_settings(config: Any) -> dict[str, Any]:
    """Return a training's settings, nested by groups, under their present names."""
    present: dict[str, Any] = {}
    for group, value in as_mapping(config, "config").items():
        name = _with_present_names(group)
        if isinstance(value, Mapping):
            value = {
                _with_present_names(f"{group}.{k}").rpartition(".")[2]: v for k, v in value.items()
            }
            if isinstance(choice := value.get("_target_"), str):
                value["_target_"] = _with_present_names(f"{name}={choice}").partition("=")[2]
        present[name] = value
    return present


def _with_present_names(override: str) -> str:
    """Return an override (`key=value`), or a key alone, under its present name."""
    for former, present in _OVERRIDES:
        override = re.sub(former, present, override)
    return override


def _write(path: Path, content: bytes) -> None:
    try:
        write_atomically(path, content)
    except OSError as error:
        raise InputError(f"{path} can't be written ({error.strerror}); give output=PATH") from error
