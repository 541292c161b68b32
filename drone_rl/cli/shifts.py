"""`drone-rl shifts`."""

import dataclasses
import logging
from pathlib import Path

import drone_rl
from drone_rl.cli.hydra.resuming import policies as prepare  # noqa: F401 -- of what was typed
from drone_rl.config.commands import PathsSettings, ShiftSettings
from drone_rl.config.configuration import DynamicsChanges, TaskChanges, no_changes

_log = logging.getLogger(__name__)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Command(ShiftSettings):
    """What `drone-rl shifts` can be told."""

    policy: str = "latest"
    """Of whom, see `drone_rl.load_policy`."""
    task: TaskChanges = no_changes()
    """What to change of the policy's task."""
    dynamics: DynamicsChanges = no_changes()
    """What to change of how the policy's drone moves."""
    paths: PathsSettings = PathsSettings()
    """Folders."""


def run(settings: Command, folder: Path) -> tuple[int, float]:
    """Flies one policy. Returns the exit status and the mean area under success over strength."""
    from drone_rl.utils.progress import log

    done = drone_rl.shifts(
        settings.policy,
        settings.narrowed(ShiftSettings),
        task=settings.task,
        dynamics=settings.dynamics,
        outputs=settings.paths.outputs,
        progress=log,
    )
    done.save(folder)
    print(done)
    _log.info("written: shifts.json, shifts.png and strips.png in %s", folder)
    return 0, done.area
