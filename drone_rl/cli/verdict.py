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
    """Certificate file to quote; none takes the one next to the policy, if it matches:
    certificate.json in the folder of a run, NAME.certificate.json next to NAME.safetensors."""
    require: Annotated[str, OneOf(("good", "proved"))] | None = None
    """Requirement for exit status 0: good, the policy is certainly good; proved, a certificate
    proves success from every placement and rollouts re-checked it, otherwise 16; null, any certain
    kind has its own exit status."""
    shifts: str | None = None
    """File shifts.json to quote; none takes the one next to the policy, otherwise the newest under
    outputs/shifts of this network and task."""
    require_domain: str | None = None
    """Operating domain in which the policy must be good, otherwise exit status 17: a YAML or JSON
    file with a range for each axis, such as domain.yaml of drone-rl shifts; null requires none."""


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
