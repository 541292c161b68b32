"""`drone-rl chain`."""

import dataclasses
import logging
from pathlib import Path
from typing import Annotated

import drone_rl
from drone_rl.cli.hydra.resuming import policies as prepare  # noqa: F401 -- of what was typed
from drone_rl.config.commands import PathsSettings
from drone_rl.config.configuration import TaskChanges, no_changes
from drone_rl.config.verification import ChanceSettings
from drone_rl.utils.schema import Real, Several

_log = logging.getLogger(__name__)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Command(ChanceSettings):
    """What `drone-rl chain` can be told."""

    policy: str = "latest"
    """Whose chances, see `drone_rl.load_policy`."""
    cubes: Annotated[tuple[float, ...], Several(Real(-10_000.0, 10_000.0, unit="m"), 0, 100)] = ()
    """Where the cubes of one placement stand, metres to the left, nearest first; none: held-out
    placements."""
    task: TaskChanges = no_changes()
    """What to change of the policy's task."""
    paths: PathsSettings = PathsSettings()
    """Folders."""


def run(settings: Command, folder: Path) -> tuple[int, float]:
    """Tells one policy's chances. Returns the exit status and the probability of success."""
    from drone_rl.utils.progress import silent

    done = drone_rl.chances(
        settings.policy,
        settings.cubes or None,
        settings.narrowed(ChanceSettings),
        task=settings.task,
        outputs=settings.paths.outputs,
        progress=silent,
    )
    done.save(folder / "chances.json")
    print(done)
    _log.info("written: %s", folder / "chances.json")
    return 0, done.success
