"""`drone-rl bodies`."""

from pathlib import Path

import drone_rl
from drone_rl.cli.settings import CommandSettings, finish
from drone_rl.config.commands import BodiesSettings
from drone_rl.utils.progress import silent


class Command(CommandSettings, BodiesSettings):
    """Settings of `drone-rl bodies`."""


def run(settings: Command, folder: Path) -> tuple[int, int]:
    """Judge policies with several vehicles; return the exit status and the number of verdicts."""
    chosen = settings.narrowed(BodiesSettings)
    done = drone_rl.bodies(settings=chosen, outputs=settings.paths.outputs, progress=silent)
    finish(done, folder, "bodies.json, bodies.png and bodies.svg")
    return 0, sum(map(len, done.numbers["policies"].values()))
