"""Policies in files: descriptions, weights and provenance."""

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import torch
from safetensors import SafetensorError
from safetensors.torch import load, save

from drone_rl.policies.zoo.description import FORMAT, MAX_PARAMETERS, parse
from drone_rl.utils.checkpoint import check_weights, load_checkpoint, other_format
from drone_rl.utils.errors import InputError, did_you_mean
from drone_rl.utils.files import last_of, parse_json, read_bytes, trained_policies
from drone_rl.utils.overrides import COMMAND
from drone_rl.utils.readers import with_current_names
from drone_rl.utils.schema import Kind, Maybe, Plain, Real, Record, Text, Whole, as_mapping, shown

MAX_HEADER = 2**20
"""Bytes of the header of an exported file."""
_TYPES = ("F32", "F64", "I64", "I32", "U8", "BOOL")
"""Types of weights, and of counters, indices and masks; the network's own decide which is right."""
_ENTRY = {"dtype", "shape", "data_offsets"}
"""Keys of each tensor in a safetensors header."""
_FOLDER = Path(__file__).resolve().parent
_COUNT = Whole(0, 2**62)
_PROGRESS = Record(
    {
        "frames": _COUNT,
        "episodes": _COUNT,
        "updates": _COUNT,
        "seconds": Real(0.0, 1e12),
        "running_reward": Real(-1e15, 1e15),
    }
)


class _Versions:
    """Names of packages with their versions."""

    def read(self, value: Any, where: str) -> dict[str, str]:
        """See `drone_rl.utils.schema.Kind`."""
        versions = Plain(most=100, deepest=1).read(as_mapping(value, where), where)
        return {key: Text(200).read(item, f"{where}.{key}") for key, item in versions.items()}


_PROVENANCE = Record(
    {
        "versions": _Versions(),
        "git_revision": Maybe(Text(200)),
        "machine": Plain(most=100, deepest=2),
    },
    optional=frozenset({"machine"}),
)
_ABOUT: dict[str, Kind] = {
    "progress": _PROGRESS,
    "provenance": _PROVENANCE,
    "command": Maybe(COMMAND),
    "verdict": Plain(),
    "worlds": Text(20),
    "seed": Whole(0),
    "chosen": Maybe(Record({"runs": _COUNT, "episodes": Maybe(_COUNT)})),
    "evaluation": Plain(),
}
_NOT_IN_ALL = frozenset({"verdict", "worlds", "seed", "chosen", "evaluation"})
"""Older files have an evaluation, newer ones a verdict and what it rests on."""


def policy_names() -> list[str]:
    """Return the names of the policies in the package."""
    return sorted(path.stem for path in _FOLDER.glob("*.safetensors"))


def policy_path(name: str) -> Path:
    """Return the file of a policy in the package."""
    return _FOLDER / f"{name}.safetensors"


def find_policy(which: str | Path, outputs: str | Path = "outputs") -> Path:
    """Return the file of a policy, see `load_policy`; raise an `InputError` if there is none.

    `outputs` is the folder of the runs. The checkpoint of a folder may be missing.
    """
    if which == "latest":
        trained = trained_policies(outputs)
        if not trained:
            raise InputError(
                f"policy=latest, but there is no run under {outputs}/train; "
                "run drone-rl train first or give the path of a checkpoint"
            )
        return trained[0]
    if which in policy_names():
        return policy_path(str(which))
    path = Path(which)
    if not str(which) or not path.exists():
        raise InputError(
            f"policy={which} does not exist; give a file, the folder of a run, latest, or one of "
            f"{', '.join(policy_names())}{did_you_mean(which, policy_names())}"
        )
    return last_of(path) if path.is_dir() else path


def card_path(name: str) -> Path:
    """Return the model card of a policy in the package."""
    return _FOLDER / f"{name}.md"


def certificate_path(policy: Path) -> Path:
    """Return the path of a policy's certificate, see `_companion`."""
    return _companion(policy, "certificate.json")


def shifts_path(policy: Path) -> Path:
    """Return the path of a policy's robustness results, see `_companion`."""
    return _companion(policy, "shifts.json")


def _companion(policy: Path, name: str) -> Path:
    """Return a path next to an exported policy, or in the run's folder of a checkpoint."""
    if policy.suffix == ".safetensors":
        return policy.with_suffix(f".{name}")
    return policy.absolute().parent.parent / name


def read_policy(path: Path) -> dict[str, Any]:
    """Read a policy from a checkpoint or an exported file (.safetensors).

    Returns:
        "description" (see `drone_rl.policies.zoo.parse`), "policy" (the weights), "progress" and
        "provenance"; of an exported file also "command" and what `export_policy` was given
        (not in files of old versions); of a checkpoint all of its state.

    Raises:
        InputError: The file is missing, damaged or something else.
    """
    return load_exported(path) if path.suffix == ".safetensors" else read_checkpoint(path)


def read_checkpoint(path: Path) -> dict[str, Any]:
    """Read a checkpoint, see `read_policy`; its "config" has plain data only."""
    state = load_checkpoint(path)
    try:
        for key in ("policy", "progress", "provenance", "config"):
            if key not in state:
                raise InputError(f"it has no {key}")
        state["config"] = Plain().read(as_mapping(state["config"], "config"), "config")
        description = parse(state.get("description"))
        checked = {
            "description": description.as_dict(),
            "policy": check_weights(state["policy"], description.expected_weights()),
            "progress": _PROGRESS.read(_progress_of(state["progress"]), "progress"),
            "provenance": _PROVENANCE.read(state["provenance"], "provenance"),
        }
    except InputError as error:
        raise InputError(f"checkpoint {path} can't be used: {error}") from None
    return {**state, **checked}


def exported_bytes(
    weights: Mapping[str, torch.Tensor], description: Mapping[str, Any], about: Mapping[str, Any]
) -> bytes:
    """Return the content of a file with weights, description and provenance."""
    layout = torch.contiguous_format
    contiguous = {name: value.clone(memory_format=layout) for name, value in weights.items()}
    metadata = {"description": json.dumps(description), "about": json.dumps(about)}
    return save(contiguous, {"format": FORMAT, **metadata})


def load_exported(path: Path) -> dict[str, Any]:
    """Read an exported policy, see `read_policy`."""
    content = read_bytes(path, 8 + MAX_HEADER + 4 * MAX_PARAMETERS)
    try:
        return _exported(content)
    except InputError as error:
        raise InputError(
            f"policy {path} can't be read: {error}; give one that drone-rl export wrote"
        ) from None


def _exported(content: bytes) -> dict[str, Any]:
    size = int.from_bytes(content[:8], "little")
    if not 2 <= size <= min(MAX_HEADER, len(content) - 8):
        other = None if content[8:9] == b"{" else other_format(content)
        raise InputError(f"it is {other or 'not in the safetensors format, or damaged'}")
    header = as_mapping(parse_json(content[8 : 8 + size], "its header"), "header")
    metadata = as_mapping(header.get("__metadata__", {}), "metadata")
    if metadata.get("format") != FORMAT:
        raise InputError("it is not a drone_rl policy")
    for name in header.keys() - {"__metadata__"}:
        entry = as_mapping(header[name], name)
        if entry.keys() != _ENTRY:
            raise InputError(f"the weights {shown(name)} do not state {', '.join(sorted(_ENTRY))}")
        if entry["dtype"] not in _TYPES:
            raise InputError(f"the weights {shown(name)} are of type {shown(entry['dtype'])}")
    about = dict(as_mapping(_inner(metadata, "about"), "about"))
    if "progress" in about:
        about["progress"] = _progress_of(about["progress"])
    description = parse(_inner(metadata, "description"))
    try:
        weights = load(content)
    except (SafetensorError, ValueError, KeyError, TypeError, RuntimeError) as error:
        raise InputError(f"its weights are damaged ({str(error)[:100]})") from None
    return {
        "description": description.as_dict(),
        "policy": check_weights(weights, description.expected_weights()),
        **Record(_ABOUT, _NOT_IN_ALL).read(about, "about"),
    }


def _inner(metadata: Mapping[str, Any], key: str) -> Any:
    text = metadata.get(key)
    if not isinstance(text, str):
        raise InputError(f"its {key} is missing")
    return parse_json(text, f"its {key}")


def _progress_of(progress: Any) -> dict[str, Any]:
    return with_current_names(as_mapping(progress, "progress"))


def fingerprint(weights: Mapping[str, torch.Tensor]) -> str:
    """Return the SHA-256 hash of a network's weights; order and device do not matter."""
    digest = hashlib.sha256()
    for name in sorted(weights):
        value = weights[name].detach().cpu().contiguous()
        digest.update(f"{name} {list(value.shape)}\n".encode())
        digest.update(value.numpy().astype("<f4").tobytes())
    return digest.hexdigest()
