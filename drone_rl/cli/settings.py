"""Settings and results that several commands share."""

import logging
from pathlib import Path
from typing import Any

from drone_rl.config.commands import PathsSettings
from drone_rl.config.configuration import DynamicsChanges, TaskChanges, no_changes
from drone_rl.utils.settings import Settings

_log = logging.getLogger(__name__)


class CommandSettings(Settings):
    """Settings of every command."""

    paths: PathsSettings = PathsSettings()
    """Folders."""


class PolicyCommandSettings(CommandSettings):
    """Settings of a command on one policy and its task."""

    policy: str = "latest"
    """Policy: a .pt or .safetensors file, the folder of a run, latest, or a shipped policy's
    name."""
    task: TaskChanges = no_changes()
    """Changes of the policy's task settings (see conf/task), as in task.num_cubes=5."""


class RolloutCommandSettings(PolicyCommandSettings):
    """Settings of a command that rolls out one policy."""

    dynamics: DynamicsChanges = no_changes()
    """Changes of the vehicle dynamics (see conf/dynamics), as in dynamics=quadrotor."""


def finish(result: Any, path: Path, files: str = "") -> None:
    """Save a result, print it, and log where it is.

    Args:
        result: It has a method `save`.
        path: Argument of `save`.
        files: Names of the files if the path is their folder.
    """
    result.save(path)
    print(result)
    _log.info("written: %s", f"{files} in {path}" if files else path)
