"""`drone-rl check`."""

import dataclasses
import logging
from pathlib import Path

import drone_rl
from drone_rl.cli.hydra.resuming import policies as prepare  # noqa: F401 -- of what was typed
from drone_rl.config.commands import PathsSettings
from drone_rl.config.configuration import TaskChanges, no_changes
from drone_rl.config.verification import CheckSettings

_log = logging.getLogger(__name__)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Command(CheckSettings):
    """What `drone-rl check` can be told."""

    certificate: str = "latest"
    """Which, see `drone_rl.check`."""
    policy: str | None = None
    """Whom it is of; none takes the policy of the package that it names."""
    task: TaskChanges = no_changes()
    """Settings of the task that it must be of; none accepts any."""
    paths: PathsSettings = PathsSettings()
    """Folders."""


def run(settings: Command, folder: Path) -> tuple[int, bool]:
    """Checks a certificate. Returns the exit status and whether it is accepted."""
    from drone_rl.utils.progress import silent

    done = drone_rl.check(
        settings.certificate,
        settings.policy,
        settings.narrowed(CheckSettings),
        task=settings.task,
        outputs=settings.paths.outputs,
        progress=silent,
    )
    done.save(folder / "check.json")
    print(done)
    _log.info("written: %s", folder / "check.json")
    return done.exit_code, done.accepted
