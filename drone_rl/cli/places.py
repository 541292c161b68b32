"""`drone-rl places`."""

from pathlib import Path

import drone_rl
from drone_rl.cli.settings import PolicyCommandSettings, finish
from drone_rl.config.commands import PlacesSettings
from drone_rl.utils.progress import silent


class Command(PolicyCommandSettings, PlacesSettings):
    """Settings of `drone-rl places`."""


def run(settings: Command, folder: Path) -> tuple[int, float]:
    """Map the outcome by cube position; return the exit status and the blind fraction."""
    done = drone_rl.places(
        settings.policy,
        settings.narrowed(PlacesSettings),
        task=settings.task,
        outputs=settings.paths.outputs,
        progress=silent,
    )
    finish(done, folder, "places.json, places.png and places.svg")
    return 0, done.numbers["blind"]
