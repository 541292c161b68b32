"""`drone-rl bodies`."""

import logging
from pathlib import Path

import drone_rl
from drone_rl.cli.settings import CommandSettings
from drone_rl.config.commands import BodiesSettings

_log = logging.getLogger(__name__)


class Command(CommandSettings, BodiesSettings):
    """Settings of `drone-rl bodies`."""


def run(settings: Command, folder: Path) -> tuple[int, int]:
    """Judge policies with several vehicles; return the exit status and the number of verdicts."""
    from drone_rl.utils.progress import silent

    asked = settings.narrowed(BodiesSettings)
    done = drone_rl.bodies(settings=asked, outputs=settings.paths.outputs, progress=silent)
    done.save(folder)
    print(done)
    _log.info("written: bodies.json, bodies.png and bodies.svg in %s", folder)
    return 0, sum(map(len, done.numbers["policies"].values()))
