"""Policies in files: descriptions, weights and provenance."""

import dataclasses
import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, ClassVar, Self

import torch
from pydantic import ConfigDict, Field, model_validator
from safetensors import SafetensorError
from safetensors.torch import load, save

from drone_rl.policies.zoo.description import FORMAT, MAX_PARAMETERS, Name, PolicyDescription
from drone_rl.utils.checkpoint import check_weights, load_checkpoint, other_format
from drone_rl.utils.errors import InputError, did_you_mean
from drone_rl.utils.files import last_of, parse_json, read_bytes, trained_policies
from drone_rl.utils.models import Model
from drone_rl.utils.overrides import COMMAND
from drone_rl.utils.provenance import Provenance
from drone_rl.utils.schema import Plain, Real, Whole, as_mapping

MAX_HEADER = 2**20
"""Bytes of the header of an exported file."""
_FOLDER = Path(__file__).resolve().parent
_EXPORT = "give a file that drone-rl export wrote"
_Count = Annotated[int, Whole(0, 2**62)]


@dataclasses.dataclass
class TrainingProgress:
    """Progress of a training run."""

    __pydantic_config__: ClassVar = ConfigDict(extra="forbid")
    frames: _Count = 0
    episodes: _Count = 0
    updates: _Count = 0
    seconds: Annotated[float, Real(0.0, 1e12)] = 0.0
    """Time spent, over all resumptions."""
    running_reward: Annotated[float, Real(-1e15, 1e15)] = 0.0
    """Running mean of the episodes' rewards, from 0, as in the original study."""


class Choice(Model):
    """How a policy was chosen in a sweep."""

    runs: _Count
    """Number of runs in the sweep."""
    episodes: _Count | None
    """Number of episodes by which they were compared; None if it was not judged there."""


class SavedPolicy(Model):
    """A policy in a file: its description, its weights and where it is from.

    Raises:
        InputError: The weights are not finite, or not those of the described network.
    """

    description: PolicyDescription
    weights: Annotated[dict[str, Any], Field(exclude=True, repr=False)]
    """Tensors by name."""
    progress: TrainingProgress
    """Progress of its training."""
    provenance: Provenance
    command: Annotated[str, COMMAND] | None = None
    """The training command."""
    verdict: Annotated[dict[str, Any], Plain()] | None = None
    """The verdict of its model card."""
    worlds: Name | None = None
    """Stream of the verdict's environments."""
    seed: _Count | None = None
    """Root of their streams."""
    chosen: Choice | None = None
    """None outside a sweep."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        check_weights(self.weights, self.description.expected_weights())
        return self

    def to_bytes(self) -> bytes:
        """Return the content of an exported file; `parse_exported` is the inverse.

        Raises:
            SafetensorError: The weights can't be written.
        """
        layout = torch.contiguous_format
        contiguous = {n: value.clone(memory_format=layout) for n, value in self.weights.items()}
        return save(contiguous, {"format": FORMAT, "policy": self.model_dump_json()})


class Checkpoint(SavedPolicy, extra="allow"):
    """A policy in a checkpoint, with what its training needs to resume."""

    config: Annotated[dict[str, Any], Plain()]
    """Settings of the training, as of `TrainSettings.config`."""

    @property
    def training(self) -> dict[str, Any]:
        """The state of the training: see `Trainer.state_dict`, and entries of the callbacks."""
        progress = dataclasses.asdict(self.progress)
        return {**(self.model_extra or {}), "policy": self.weights, "progress": progress}


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


def read_policy(path: Path) -> SavedPolicy:
    """Read a policy from a checkpoint or an exported file (.safetensors).

    Raises:
        InputError: The file is missing, damaged or something else.
    """
    if path.suffix != ".safetensors":
        return read_checkpoint(path)
    content = read_exported_bytes(path)
    try:
        return parse_exported(content, path)
    except InputError as error:
        raise InputError(f"policy {path} can't be read: {error}") from None


def read_checkpoint(path: Path) -> Checkpoint:
    """Read a checkpoint, see `read_policy`."""
    state = load_checkpoint(path)
    try:
        return parse_checkpoint(state)
    except InputError as error:
        raise InputError(f"checkpoint {path} can't be used: {error}") from None


def parse_checkpoint(state: Mapping[str, Any]) -> Checkpoint:
    """Return the checkpoint with such content; raise an `InputError` if it is unusable."""
    names = {"policy": "weights"}
    own = {names.get(k, k): v for k, v in state.items() if k not in ("format", "format_version")}
    return Checkpoint.read(own)


def read_exported_bytes(path: Path) -> bytes:
    """Return the content of a file that is not larger than the largest exported policy."""
    return read_bytes(path, 8 + MAX_HEADER + 4 * MAX_PARAMETERS)


def parse_exported(content: bytes, path: Path) -> SavedPolicy:
    """Return an exported policy from the content of its file, whose path messages name."""
    text = metadata_of(content).get("policy")
    if not isinstance(text, str):
        raise InputError(f"it has a former layout; convert it with drone-rl convert {path}")
    about = as_mapping(parse_json(text, "its description"), "its description")
    return SavedPolicy.read({**about, "weights": weights_of(content)})


def weights_of(content: bytes) -> dict[str, torch.Tensor]:
    """Return the tensors in the content of an exported file."""
    try:
        return load(content)
    except (SafetensorError, ValueError, KeyError, TypeError, RuntimeError) as error:
        raise InputError(f"its weights are damaged ({str(error)[:100]}); {_EXPORT}") from None


def metadata_of(content: bytes) -> Mapping[str, Any]:
    """Return the metadata of an exported file, unchecked texts by name."""
    size = int.from_bytes(content[:8], "little")
    if not 2 <= size <= min(MAX_HEADER, len(content) - 8):
        other = None if content[8:9] == b"{" else other_format(content)
        damaged = f"not in the safetensors format, or damaged; {_EXPORT}"
        raise InputError(f"it is {other or damaged}")
    header = as_mapping(parse_json(content[8 : 8 + size], "its header"), "header")
    metadata = as_mapping(header.get("__metadata__", {}), "metadata")
    if metadata.get("format") != FORMAT:
        raise InputError(f"it is not a drone_rl policy; {_EXPORT}")
    return metadata


def fingerprint(weights: Mapping[str, torch.Tensor]) -> str:
    """Return the SHA-256 hash of a network's weights; order and device do not matter."""
    digest = hashlib.sha256()
    for name in sorted(weights):
        value = weights[name].detach().cpu().contiguous()
        digest.update(f"{name} {list(value.shape)}\n".encode())
        digest.update(value.numpy().astype("<f4").tobytes())
    return digest.hexdigest()
