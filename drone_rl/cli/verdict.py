"""`drone-rl verdict`."""

import dataclasses
import logging
from pathlib import Path
from typing import Annotated

import drone_rl
from drone_rl.cli.hydra.resuming import policies as prepare  # noqa: F401 -- of what was typed
from drone_rl.config.commands import JudgeSettings, PathsSettings
from drone_rl.config.configuration import DynamicsChanges, TaskChanges, no_changes
from drone_rl.utils.schema import OneOf

_log = logging.getLogger(__name__)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Command(JudgeSettings):
    """What `drone-rl verdict` can be told."""

    policy: str = "latest"
    """Whom to judge, see `drone_rl.judge`."""
    certificate: str | None = None
    """A proof's file to quote; none takes the one that lies with the policy, if there is one."""
    require: Annotated[str, OneOf(("good", "proved"))] | None = None
    """good: 0 only for a certain good, else the verdict's own exit status. proved: 0 only if a
    re-checked certificate says so of every placement, else 16. None: by kind."""
    shifts: str | None = None
    """A file of drone-rl shifts to quote; none takes the policy's, or the newest of its own."""
    require_domain: str | None = None
    """Refuse (exit status 17) what is not good where this file says; none asks for no range."""
    task: TaskChanges = no_changes()
    """What to change of the policy's task."""
    dynamics: DynamicsChanges = no_changes()
    """What to change of how the policy's drone moves."""
    paths: PathsSettings = PathsSettings()
    """Folders."""


def run(settings: Command, folder: Path) -> tuple[int, str]:
    """Judges one policy. Returns the exit status and the kind's name."""
    from drone_rl.utils.progress import silent

    outputs = settings.paths.outputs
    done = drone_rl.judge(
        settings.policy,
        settings,
        task=settings.task,
        dynamics=settings.dynamics,
        certificate=settings.certificate,
        shifts=settings.shifts,
        require_domain=settings.require_domain,
        outputs=outputs,
        progress=silent,
    )
    done.save(folder / "verdict.json")
    print(done)
    _log.info("written: %s", folder / "verdict.json")
    if settings.require == "proved" and done.verdict.evidence["proof"] is None:
        _log.info("no certificate lies with it; make one by drone-rl prove, give certificate=")
    return done.status(settings.require), done.verdict.kind.value
