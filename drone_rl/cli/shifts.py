"""`drone-rl shifts`."""

import logging
from pathlib import Path

import drone_rl
from drone_rl.cli.hydra.resuming import policies as prepare  # noqa: F401
from drone_rl.cli.settings import RolloutCommandSettings
from drone_rl.config.commands import ShiftSettings

_log = logging.getLogger(__name__)


class Command(RolloutCommandSettings, ShiftSettings):
    """Settings of `drone-rl shifts`."""


def run(settings: Command, folder: Path) -> tuple[int, float]:
    """Measure robustness; return the exit status and the mean area under success over strength."""
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
