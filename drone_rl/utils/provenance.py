"""Provenance of results: versions, git revision, machine."""

import os
import platform
import subprocess
from importlib import metadata
from pathlib import Path
from typing import Annotated

from drone_rl.utils.models import Stored
from drone_rl.utils.schema import Text

PACKAGES = (
    *("drone-rl", "torch", "torchrl", "tensordict", "mujoco", "mujoco-warp", "warp-lang"),
    *("dm_control", "hydra-core", "numpy"),
)

Line = Annotated[str, Text(200)]


class Provenance(Stored):
    """Base of results whose files record where they are from."""

    versions: dict[Line, Line] = {}
    """Versions of Python and of packages."""
    git_revision: Line | None = None
    machine: dict[Line, Line | int | None] = {}


def versions() -> dict[str, str]:
    """Return the versions of Python and of the packages that results depend on."""
    installed = {"python": platform.python_version()}
    for name in PACKAGES:
        try:
            installed[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            installed[name] = "not installed"
    return installed


def git_revision() -> str | None:
    """Return the commit of the checkout, with "-dirty" if changed; None outside a checkout."""
    root = Path(__file__).resolve().parents[2]
    if not (root / ".git").exists():
        return None
    try:
        revision = _git(root, "rev-parse", "HEAD")
        return revision + ("-dirty" if _git(root, "status", "--porcelain", "-uno") else "")
    except (OSError, subprocess.CalledProcessError):
        return None


def num_cores() -> int:
    """Return the number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def machine() -> dict[str, str | int | None]:
    """Return the system, the kind of processor and the number of cores."""
    names = {"system": platform.platform(), "processor": platform.machine()}
    return {**names, "cores": num_cores()}


def provenance() -> dict:
    """Return versions, revision and machine as plain values."""
    return {"versions": versions(), "git_revision": git_revision(), "machine": machine()}


def _git(root: Path, *args: str) -> str:
    command = ["git", "-C", str(root), *args]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()
