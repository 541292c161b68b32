"""Convert policies of version 0.1 to the present layout.

Only this module knows how version 0.1 described policies. The training command in a file is left
as it is, since it repeats the training at the revision in the file.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from drone_rl.config import MOVES_SETTINGS
from drone_rl.config.inputs import PIXELS
from drone_rl.config.task import DEFAULT_TASK
from drone_rl.policies.zoo.description import ActionSpace, PolicyDescription
from drone_rl.policies.zoo.files import SavedPolicy, metadata_of, read_exported_bytes, weights_of
from drone_rl.utils.checkpoint import read_any_version
from drone_rl.utils.errors import InputError
from drone_rl.utils.files import parse_json, write_atomically
from drone_rl.utils.schema import as_mapping

_DESCRIBED = {"format", "format_version", "task", "camera", "transforms", "network"}
"""Entries of a description of version 0.1."""


def convert(path: Path, output: Path | None = None) -> Path:
    """Write a policy of version 0.1 as a .safetensors file of the present layout.

    Args:
        path: A .safetensors file of `drone-rl export`, or a checkpoint (.pt).
        output: The new file; by default NAME_converted.safetensors next to the old one.

    Returns:
        The new file.

    Raises:
        InputError: The file is unusable or has another layout, or the output exists.
    """
    output = output or path.with_name(f"{path.stem}_converted.safetensors")
    if output.exists() or output.suffix != ".safetensors":
        fault = "exists" if output.exists() else "does not end in .safetensors"
        raise InputError(f"output={output} {fault}; give another path")
    try:
        content = _read(path).to_bytes()
    except InputError as error:
        raise InputError(f"{path} can't be converted: {error}") from None
    try:
        write_atomically(output, content)
    except OSError as error:
        raise InputError(
            f"{output} can't be written ({error.strerror}); give output=PATH"
        ) from error
    return output


def _read(path: Path) -> SavedPolicy:
    if path.suffix == ".safetensors":
        content = read_exported_bytes(path)
        metadata, weights = metadata_of(content), weights_of(content)
        texts = {n: parse_json(str(metadata.get(n)), f"its {n}") for n in ("about", "description")}
        former = {**as_mapping(texts["about"], "its about"), **texts}
    else:
        former = read_any_version(path)
        weights = former.get("policy")
    progress = dict(as_mapping(former.get("progress"), "progress"))
    progress["running_reward"] = progress.pop("running_cubes", 0.0)
    return SavedPolicy.read(
        {
            **{name: of for name, of in former.items() if name in SavedPolicy.model_fields},
            "progress": progress,
            "description": _described(as_mapping(former.get("description"), "its description")),
            "weights": weights,
        }
    )


def _described(former: Mapping[str, Any]) -> PolicyDescription:
    if former.keys() != _DESCRIBED or former["format_version"] != 2:
        raise InputError(
            "it is not of version 0.1; use it as it is if this version wrote it, else make it again"
        )
    try:
        camera = former["camera"]
        image = {
            "kind": "image",
            "camera": {"horizontal_fov": camera["horizontal_fov"]},
            "size": [camera["height"], camera["width"]],
            "transforms": former["transforms"],
        }
    except (LookupError, TypeError) as error:
        raise InputError(f"its description is damaged ({error})") from None
    return PolicyDescription.read(
        {
            "task": {"name": DEFAULT_TASK, "parameters": former["task"]},
            "inputs": {PIXELS: image},
            "actions": ActionSpace.of(MOVES_SETTINGS),
            "network": former["network"],
        }
    )
