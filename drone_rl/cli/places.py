"""`drone-rl places`."""

import dataclasses
import logging
from pathlib import Path

import drone_rl
from drone_rl.cli.hydra.resuming import policies as prepare  # noqa: F401 -- of what was typed
from drone_rl.config.commands import PathsSettings
from drone_rl.config.configuration import TaskChanges, no_changes
from drone_rl.config.verification import PlacesSettings

_log = logging.getLogger(__name__)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Command(PlacesSettings):
    """What `drone-rl places` can be told."""

    policy: str = "latest"
    """Of whom, see `drone_rl.load_policy`."""
    task: TaskChanges = no_changes()
    """What to change of the policy's task."""
    paths: PathsSettings = PathsSettings()
    """Folders."""


def run(settings: Command, folder: Path) -> tuple[int, float]:
    """Maps one policy's places. Returns the exit status and the share of blind ones."""
    from drone_rl.utils.progress import silent

    done = drone_rl.places(
        settings.policy,
        settings.narrowed(PlacesSettings),
        task=settings.task,
        outputs=settings.paths.outputs,
        progress=silent,
    )
    done.save(folder)
    print(done)
    _log.info("written: places.json, places.png and places.svg in %s", folder)
    return 0, done.numbers["blind"]
