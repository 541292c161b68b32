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
    """The policy, see `drone_rl.load_policy`."""
    task: TaskChanges = no_changes()
    """Changes of the policy's task."""


class RolloutCommandSettings(PolicyCommandSettings):
    """Settings of a command that rolls out one policy."""

    dynamics: DynamicsChanges = no_changes()
    """Changes of the policy's vehicle dynamics."""


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
