"""`drone-rl prove`."""

import dataclasses
import logging
from pathlib import Path

import drone_rl
from drone_rl.cli.hydra.resuming import policies as prepare  # noqa: F401 -- of what was typed
from drone_rl.config.commands import PathsSettings
from drone_rl.config.configuration import TaskChanges, no_changes
from drone_rl.config.verification import ProveSettings

NOT_PROVED = 15
"""Exit status: some placements are lost, or undecided."""

_log = logging.getLogger(__name__)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Command(ProveSettings):
    """What `drone-rl prove` can be told."""

    policy: str = "latest"
    """Of whom, see `drone_rl.load_policy`."""
    task: TaskChanges = no_changes()
    """What to change of the policy's task."""
    paths: PathsSettings = PathsSettings()
    """Folders."""


def run(settings: Command, folder: Path) -> tuple[int, float]:
    """Proves. Returns the exit status and the share of placements with success."""
    proof = drone_rl.prove(
        settings.policy,
        settings.narrowed(ProveSettings),
        folder=folder,
        task=settings.task,
        outputs=settings.paths.outputs,
    )
    print(proof)
    _log.info("written: %s", folder / "certificate.json")
    if proof.certificate["found"]["stopped_by"] == "limit_s":
        _log.info("go on with the same command and hydra.run.dir=%s", folder)
    return 0 if proof.is_proved else NOT_PROVED, proof.success
