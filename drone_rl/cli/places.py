"""`drone-rl places`."""

import logging
from pathlib import Path

import drone_rl
from drone_rl.cli.hydra.resuming import policies as prepare  # noqa: F401
from drone_rl.cli.settings import PolicyCommandSettings
from drone_rl.config.verification import PlacesSettings

_log = logging.getLogger(__name__)


class Command(PolicyCommandSettings, PlacesSettings):
    """Settings of `drone-rl places`."""


def run(settings: Command, folder: Path) -> tuple[int, float]:
    """Map the outcome by cube position; return the exit status and the blind fraction."""
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
