"""`drone-rl verdict`."""

import logging
from pathlib import Path
from typing import Annotated

import drone_rl
from drone_rl.cli.settings import RolloutCommandSettings, finish
from drone_rl.config.commands import JudgeSettings
from drone_rl.utils.progress import silent
from drone_rl.utils.schema import OneOf

_log = logging.getLogger(__name__)


class Command(RolloutCommandSettings, JudgeSettings):
    """Settings of `drone-rl verdict`."""

    certificate: str | None = None
    """Certificate to quote; none takes the one next to the policy, if any."""
    require: Annotated[str, OneOf(("good", "proved"))] | None = None
    """good: 0 only for a certain good, else the verdict's own exit status. proved: 0 only if a
    re-checked certificate says so of every placement, else 16. None: by kind."""
    shifts: str | None = None
    """Result of drone-rl shifts to quote; none takes the policy's, or its newest."""
    require_domain: str | None = None
    """Refuse (exit status 17) a policy that is not good in the domain of this file; none: any."""


def run(settings: Command, folder: Path) -> tuple[int, str]:
    """Judge one policy; return the exit status and the kind's name."""
    done = drone_rl.judge(
        settings.policy,
        settings,
        task=settings.task,
        dynamics=settings.dynamics,
        certificate=settings.certificate,
        shifts=settings.shifts,
        require_domain=settings.require_domain,
        outputs=settings.paths.outputs,
        progress=silent,
    )
    finish(done, folder / "verdict.json")
    if settings.require == "proved" and done.verdict.evidence["proof"] is None:
        _log.info(
            "the policy has no certificate; make one with drone-rl prove, or give certificate="
        )
    return done.status(settings.require), done.verdict.kind.value
