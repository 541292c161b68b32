"""Policies as safetensors files: parameters, and as metadata all that is needed to run them."""

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import save_file

from drone_rl.utils.errors import InputError

FORMAT = "drone_rl policy"
_LOCAL = ("logger", "paths", "resume")
"""Settings that speak of the machine where the training ran."""
_FOLDER = Path(__file__).resolve().parent


def policy_names() -> list[str]:
    """Names of the policies that travel with the package."""
    return sorted(path.stem for path in _FOLDER.glob("*.safetensors"))


def policy_path(name: str) -> Path:
    """File of a policy that travels with the package."""
    return _FOLDER / f"{name}.safetensors"


def card_path(name: str) -> Path:
    """Model card of such a policy."""
    return _FOLDER / f"{name}.md"


def export_policy(
    path: Path, checkpoint: Mapping[str, Any], *, command: str, evaluation: Mapping[str, Any]
) -> None:
    """Writes a checkpoint's policy and its model card beside it.

    Args:
        path: Where to, ending in .safetensors; the card ends in .md.
        checkpoint: From `load_checkpoint`.
        command: The training command.
        evaluation: From `summarise`.

    Raises:
        InputError: It can't be written.
    """
    parameters = {k: v.contiguous() for k, v in checkpoint["policy"].items()}
    origin = checkpoint["provenance"]
    about = {
        "config": {k: v for k, v in checkpoint["config"].items() if k not in _LOCAL},
        "progress": checkpoint["progress"],
        "provenance": {k: origin[k] for k in ("versions", "git_revision")},
        "command": command,
        "evaluation": evaluation,
    }
    try:
        save_file(parameters, path, {"format": FORMAT, "about": json.dumps(about)})
        path.with_suffix(".md").write_text(_card(path, about))
    except (OSError, SafetensorError) as error:
        raise InputError(f"policy {path} can't be written ({error})") from error


def load_exported(path: Path) -> dict[str, Any]:
    """Reads a policy in the form of a checkpoint: "policy", "config", "progress" and more.

    Raises:
        InputError: The file is missing, damaged or something else.
    """
    try:
        with safe_open(path, framework="pt") as file:
            metadata = file.metadata() or {}
            parameters: dict[str, torch.Tensor] = {k: file.get_tensor(k) for k in file.keys()}  # noqa: SIM118
    except (OSError, SafetensorError) as error:
        raise InputError(f"policy {path} can't be read ({error}); export it again") from error
    if metadata.get("format") != FORMAT:
        raise InputError(f"{path} is not a drone_rl policy; use one that drone-rl export wrote")
    return {"policy": parameters, **json.loads(metadata["about"])}


def _card(path: Path, about: Mapping[str, Any]) -> str:
    evaluation = about["evaluation"]
    rows = [("mean cubes", f"{evaluation['mean_cubes']:.3f}")]
    success = evaluation["success"]
    for name, found in {"all cubes": success, **evaluation["shares"]}.items():
        value = found["share"] if found is success else found["mean"]
        interval = f"{found['lower95']:.3f} to {found['upper95']:.3f}"
        text = "not offered" if value is None else f"{value:.3f} (95%: {interval})"
        rows.append((name if found is success else f"share collected: {name}", text))
    table = "\n".join(f"| {name} | {value} |" for name, value in rows)
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    packages = about["provenance"]["versions"]
    revision = about["provenance"]["git_revision"] or "unknown"
    return f"""# {path.stem}

Trained by `{about["command"]}` in {about["progress"]["frames"]:,} frames; the settings are in the
file's metadata. Evaluated on {evaluation["episodes"]:,} held-out episodes, greedy:

| | |
| --- | --- |
{table}

- SHA-256 of `{path.name}`: `{digest}`
- revision {revision}; torch {packages["torch"]}, torchrl {packages["torchrl"]}, mujoco-warp
  {packages["mujoco-warp"]}
- intended use: an example for `drone-rl explain policy={path.stem}`; not for a real drone
"""
