"""Settings that several commands share."""

from drone_rl.config.commands import PathsSettings
from drone_rl.config.configuration import DynamicsChanges, TaskChanges, no_changes
from drone_rl.utils.settings import Settings


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
