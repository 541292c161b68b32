"""`drone-rl shifts`."""

from pathlib import Path

import drone_rl
from drone_rl.cli.settings import RolloutCommandSettings, finish
from drone_rl.config.commands import ShiftSettings
from drone_rl.utils.progress import log


class Command(RolloutCommandSettings, ShiftSettings):
    """Settings of `drone-rl shifts`."""


def run(settings: Command, folder: Path) -> tuple[int, float]:
    """Measure robustness; return the exit status and the mean area under success over strength."""
    done = drone_rl.shifts(
        settings.policy,
        settings.narrowed(ShiftSettings),
        task=settings.task,
        dynamics=settings.dynamics,
        outputs=settings.paths.outputs,
        progress=log,
    )
    finish(done, folder, "shifts.json, shifts.png and strips.png")
    return 0, done.area
