"""Convert files of older versions to the present layout.

Only this module knows how descriptions of policies were laid out before, and the names that
settings and figures had in version 0.1. The training command in a file is left as it is, since it
repeats the training at the revision in the file.
"""

import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from drone_rl.config import ActionSettings
from drone_rl.config.inputs import PIXELS
from drone_rl.config.task import DEFAULT_TASK
from drone_rl.policies.zoo.description import (
    FORMAT_VERSION,
    ActionSpace,
    PolicyDescription,
)
from drone_rl.policies.zoo.files import (
    SavedPolicy,
    metadata_of,
    parse_checkpoint,
    read_exported_bytes,
    weights_of,
)
from drone_rl.utils import checkpoint
from drone_rl.utils.errors import InputError
from drone_rl.utils.files import parse_json, read_json, refuse_links, write_atomically
from drone_rl.utils.limits import SHIFTS_BYTES
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
_PENALTY = "collision_penalty"
"""A setting of tasks, before it became the weight of a term."""
_DESCRIBED = {"certificate.json": "policy", "shifts.json": "network"}
"""The entry with the policy's description, by the end of the name of a file."""
_FOLDERS = 100
"""Most levels of folders to search."""


class _PresentError(InputError):
    """A file that has the present layout."""


def convert(path: Path, output: Path | None = None) -> list[Path]:
    """Convert a file, or in their places all files of a run or a sweep.

    A converted file of a folder replaces the former one, which is kept as NAME_former.

    Args:
        path: A .safetensors file of `drone-rl export`, a checkpoint (.pt), a certificate.json, a
            shifts.json, or a folder.
        output: The new file; by default NAME_converted next to the old one. None for a folder.

    Returns:
        The new files.

    Raises:
        InputError: A file is unusable, none has a former layout, or the output exists.
    """
    if not path.exists() or path == Path():
        raise InputError(
            f"file={path} does not exist; give a file, or the folder of a run or sweep"
        )
    if not path.is_dir():
        output = output or path.with_stem(f"{path.stem}_converted")
        if output.exists() or output.suffix != path.suffix:
            fault = "exists" if output.exists() else f"does not end in {path.suffix}"
            raise InputError(f"output={output} {fault}; give another path")
        _write(output, _converted(path))
        return [output]
    if output is not None:
        raise InputError(f"{path} is a folder, which is converted in its place; leave output out")
    refuse_links(path, _FOLDERS)
    results = [f"**/{before}{name}" for name in _DESCRIBED for before in ("", "*.")]
    names = ("**/checkpoints/*.pt", "**/*.safetensors", *results)
    files = [file for name in names for file in sorted(path.glob(name)) if not _is_kept(file)]
    converted = [file for file in files if _convert_in_place(file)]
    if not converted:
        raise InputError(f"{path} holds no files of a former layout; use it as it is")
    return converted


def _is_kept(path: Path) -> bool:
    return path.stem.endswith("_former")


def _convert_in_place(path: Path) -> bool:
    """Convert a file and keep the former one; return False if it has the present layout."""
    try:
        converted = _converted(path)
    except _PresentError:
        return False
    _write(path.with_stem(f"{path.stem}_former"), path.read_bytes())
    _write(path, converted)
    return True


def _converted(path: Path) -> bytes | dict[str, Any]:
    """Return the content, or a checkpoint's state; raise `_PresentError` if it is of now."""
    try:
        if path.suffix == ".safetensors":
            return _converted_export(read_exported_bytes(path))
        if path.suffix == ".json":
            return _converted_result(path)
        return _converted_state(checkpoint.read_any_version(path))
    except _PresentError:
        raise _PresentError(f"{path} has the present layout; use it as it is") from None
    except InputError as error:
        raise InputError(
            f"{path} can't be converted ({error}); if it is from before version 0.1, make it again"
        ) from None


def _write(path: Path, converted: bytes | dict[str, Any]) -> None:
    if not isinstance(converted, bytes):
        return checkpoint.save_checkpoint(path, converted)
    try:
        write_atomically(path, converted)
    except OSError as error:
        raise InputError(f"{path} can't be written ({error.strerror}); give output=PATH") from error


def _converted_export(content: bytes) -> bytes:
    metadata = metadata_of(content)
    if "policy" in metadata:
        raise _PresentError
    description, about = (
        as_mapping(parse_json(str(metadata.get(name)), f"its {name}"), f"its {name}")
        for name in ("description", "about")
    )
    known = {name: of for name, of in about.items() if name in SavedPolicy.model_fields}
    converted = SavedPolicy.read(
        {
            **known,
            "progress": _with_present_figures(about.get("progress")),
            "description": _converted_description(description),
            "weights": weights_of(content),
        }
    )
    return converted.to_bytes()


def _converted_result(path: Path) -> bytes:
    """Return the content of a certificate or of robustness results."""
    content = dict(as_mapping(read_json(path, SHIFTS_BYTES), "it"))
    entry = next((e for end, e in _DESCRIBED.items() if path.name.endswith(end)), "policy")
    of = as_mapping(content.get(entry), entry)
    described = _converted_description(as_mapping(of.get("description"), "its description"))
    content[entry] = {**of, "description": described.model_dump(mode="json")}
    return json.dumps(content).encode()


def _with_reward_terms(task: Mapping[str, Any]) -> dict[str, Any]:
    """Return settings of a task in which a former penalty is the weight of a term."""
    present = dict(task)
    if _PENALTY in present:
        present["reward"] = {"progress": 1.0, "contact": -float(present.pop(_PENALTY))}
    return present


def _converted_description(former: Mapping[str, Any]) -> PolicyDescription:
    """Return the description that was laid out as version 2."""
    if former.get("format_version") == FORMAT_VERSION:
        raise _PresentError
    try:
        task, camera = _with_reward_terms(former["task"]), former["camera"]
        image = {
            "kind": "image",
            "camera": {"horizontal_fov": camera["horizontal_fov"]},
            "size": [camera["height"], camera["width"]],
            "transforms": former["transforms"],
        }
        optional = {n: former[n] for n in ("appearance", "dynamics") if n in former}
        present = {
            "task": {
                "name": task.pop("name", DEFAULT_TASK),
                "rewards": task.pop("reward", {}),
                "parameters": task,
            },
            "inputs": {PIXELS: image},
            "actions": ActionSpace.of(ActionSettings.read(former.get("actions", {}), "actions")),
            "network": former["network"],
            **optional,
        }
    except (LookupError, TypeError, ValueError) as error:
        raise InputError(f"its description is damaged ({error})") from None
    return PolicyDescription.read(present)


def _converted_state(state: Mapping[str, Any]) -> dict[str, Any]:
    if state.get("format_version") == checkpoint.FORMAT_VERSION:
        raise _PresentError
    present = {
        _with_present_names(name): value for name, value in state.items() if name != "policy"
    }
    present["policy"] = state.get("policy")
    present["progress"] = _with_present_figures(state.get("progress"))
    present["config"] = _with_present_settings(state.get("config"))
    former = as_mapping(state.get("description"), "its description")
    present["description"] = _converted_description(former).model_dump(mode="json")
    for name in ("format", "format_version"):
        del present[name]
    parse_checkpoint(present)
    return present


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
            value = _with_reward_terms(value) if group == "task" else value
            if isinstance(choice := value.get("_target_"), str):
                value["_target_"] = _with_present_names(f"{name}={choice}").partition("=")[2]
        present[name] = value
    return present


def _with_present_names(override: str) -> str:
    """Return an override (`key=value`), or a key alone, under its present name."""
    for former, present in _OVERRIDES:
        override = re.sub(former, present, override)
    return override
