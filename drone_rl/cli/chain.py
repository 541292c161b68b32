"""`drone-rl chain`."""

from pathlib import Path
from typing import Annotated

import drone_rl
from drone_rl.cli.settings import PolicyCommandSettings, finish
from drone_rl.config.commands import ChanceSettings
from drone_rl.utils.progress import silent
from drone_rl.utils.schema import Real, Several


class Command(PolicyCommandSettings, ChanceSettings):
    """Settings of `drone-rl chain`."""

    cubes: Annotated[tuple[float, ...], Several(Real(-10_000.0, 10_000.0, unit="m"), 0, 100)] = ()
    """Lateral positions of the cubes of one placement, metres to the left, nearest first; none:
    held-out placements."""


def run(settings: Command, folder: Path) -> tuple[int, float]:
    """Compute the outcome probabilities; return the exit status and the success probability."""
    done = drone_rl.chances(
        settings.policy,
        settings.cubes or None,
        settings.narrowed(ChanceSettings),
        task=settings.task,
        outputs=settings.paths.outputs,
        progress=silent,
    )
    finish(done, folder / "chances.json")
    return 0, done.success
