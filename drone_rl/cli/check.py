"""`drone-rl check`."""

from pathlib import Path

import drone_rl
from drone_rl.cli.settings import CommandSettings, finish
from drone_rl.config.configuration import TaskChanges, no_changes
from drone_rl.config.verification import CheckSettings
from drone_rl.utils.progress import silent


class Command(CommandSettings, CheckSettings):
    """Settings of `drone-rl check`."""

    certificate: str = "latest"
    """The certificate, see `drone_rl.check`."""
    policy: str | None = None
    """Its policy; none takes the policy of the package that it names."""
    task: TaskChanges = no_changes()
    """Required settings of its task; none accepts any."""


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
