"""`drone-rl verdict`."""

import dataclasses
import logging
from pathlib import Path

import drone_rl
from drone_rl.hydra_app.names import policies as prepare  # noqa: F401 -- of what was typed
from drone_rl.settings.changes import TaskChanges, no_changes
from drone_rl.settings.judging import JudgeSettings
from drone_rl.settings.paths import PathsSettings

_log = logging.getLogger(__name__)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Command(JudgeSettings):
    """What `drone-rl verdict` can be told."""

    policy: str = "latest"
    """Whom to judge, see `drone_rl.judge`."""
    task: TaskChanges = no_changes()
    """What to change of the policy's task."""
    paths: PathsSettings = PathsSettings()
    """Folders."""


def run(settings: Command, folder: Path) -> tuple[int, str]:
    """Judges one policy. Returns the verdict's exit status and the kind's name."""
    from drone_rl.api.progress import silent

    outputs = settings.paths.outputs
    done = drone_rl.judge(
        settings.policy, settings, task=settings.task, outputs=outputs, progress=silent
    )
    done.save(folder / "verdict.json")
    print(done)
    _log.info("written: %s", folder / "verdict.json")
    return done.verdict.exit_code, done.verdict.kind.value
