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
from drone_rl.utils.schema import Maybe, Plain, Real, Record, Text, Whole, as_mapping

MAX_HEADER = 2**20
"""Bytes of the header of an exported file."""
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
_PROVENANCE = Record(
    {"versions": Plain(), "git_revision": Maybe(Text(200)), "machine": Plain()},
    optional=frozenset({"machine"}),
)
ABOUT = Record(
    {
        "progress": _PROGRESS,
        "provenance": _PROVENANCE,
        "command": Maybe(COMMAND),
        "verdict": Plain(),
        "worlds": Text(20),
        "seed": Whole(0),
        "chosen": Maybe(Record({"runs": _COUNT, "episodes": Maybe(_COUNT)})),
    },
    optional=frozenset({"verdict", "worlds", "seed", "chosen"}),
)
"""What an exported file contains about the training and the verdict of its policy."""


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
        return checked_state(state)
    except InputError as error:
        raise InputError(f"checkpoint {path} can't be used: {error}") from None


def checked_state(state: Mapping[str, Any]) -> dict[str, Any]:
    """Return the state of a checkpoint; raise an `InputError` if its policy is unusable."""
    for key in ("policy", "progress", "provenance", "config"):
        if key not in state:
            raise InputError(f"it has no {key}")
    description = parse(state.get("description"))
    return {
        **state,
        "config": Plain().read(as_mapping(state["config"], "config"), "config"),
        "description": description.as_dict(),
        "policy": check_weights(state["policy"], description.expected_weights()),
        "progress": _PROGRESS.read(state["progress"], "progress"),
        "provenance": _PROVENANCE.read(state["provenance"], "provenance"),
    }


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
    content = read_exported_bytes(path)
    try:
        return parse_exported(content)
    except InputError as error:
        raise InputError(
            f"policy {path} can't be read: {error}; give one that drone-rl export wrote, or "
            f"convert one of an older version with drone-rl convert {path}"
        ) from None


def read_exported_bytes(path: Path) -> bytes:
    """Return the content of a file that is not larger than the largest exported policy."""
    return read_bytes(path, 8 + MAX_HEADER + 4 * MAX_PARAMETERS)


def parse_exported(content: bytes) -> dict[str, Any]:
    """Return an exported policy, see `read_policy`, from the content of its file."""
    data, about = metadata_of(content)
    description = parse(data)
    try:
        weights = load(content)
    except (SafetensorError, ValueError, KeyError, TypeError, RuntimeError) as error:
        raise InputError(f"its weights are damaged ({str(error)[:100]})") from None
    return {
        "description": description.as_dict(),
        "policy": check_weights(weights, description.expected_weights()),
        **ABOUT.read(about, "about"),
    }


def metadata_of(content: bytes) -> tuple[Any, Any]:
    """Return the plain data of an exported file, unchecked: its description, and `ABOUT`."""
    size = int.from_bytes(content[:8], "little")
    if not 2 <= size <= min(MAX_HEADER, len(content) - 8):
        other = None if content[8:9] == b"{" else other_format(content)
        raise InputError(f"it is {other or 'not in the safetensors format, or damaged'}")
    header = as_mapping(parse_json(content[8 : 8 + size], "its header"), "header")
    metadata = as_mapping(header.get("__metadata__", {}), "metadata")
    if metadata.get("format") != FORMAT:
        raise InputError("it is not a drone_rl policy")
    texts = {key: metadata.get(key) for key in ("description", "about")}
    for key, text in texts.items():
        if not isinstance(text, str):
            raise InputError(f"its {key} is missing")
    description, about = (parse_json(str(text), f"its {key}") for key, text in texts.items())
    return description, about


def fingerprint(weights: Mapping[str, torch.Tensor]) -> str:
    """Return the SHA-256 hash of a network's weights; order and device do not matter."""
    digest = hashlib.sha256()
    for name in sorted(weights):
        value = weights[name].detach().cpu().contiguous()
        digest.update(f"{name} {list(value.shape)}\n".encode())
        digest.update(value.numpy().astype("<f4").tobytes())
    return digest.hexdigest()
