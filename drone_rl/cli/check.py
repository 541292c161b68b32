"""`drone-rl check`."""

from pathlib import Path

import drone_rl
from drone_rl.cli.settings import CommandSettings, finish
from drone_rl.config.commands import CheckSettings
from drone_rl.config.configuration import TaskChanges, no_changes
from drone_rl.utils.progress import silent


class Command(CommandSettings, CheckSettings):
    """Settings of `drone-rl check`."""

    certificate: str = "latest"
    """Certificate: a file of drone-rl prove, or latest for the newest one."""
    policy: str | None = None
    """Policy of the certificate, as a file, the folder of a run, latest, or a shipped policy's
    name; none takes the shipped policy that the certificate names."""
    task: TaskChanges = no_changes()
    """Settings that the certificate's task must have, as in task.num_cubes=5; none accepts any."""


def run(settings: Command, folder: Path) -> tuple[int, bool]:
    """Check a certificate; return the exit status and whether it is accepted."""
    done = drone_rl.check(
        settings.certificate,
        settings.policy,
        settings.narrowed(CheckSettings),
        task=settings.task,
        outputs=settings.paths.outputs,
        progress=silent,
    )
    finish(done, folder / "check.json")
    return done.exit_code, done.accepted
