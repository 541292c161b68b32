"""`drone-rl prove`."""

import logging
from pathlib import Path

import drone_rl
from drone_rl.cli.settings import PolicyCommandSettings
from drone_rl.config.commands import ProveSettings

NOT_PROVED = 15
"""Exit status if some placements fail or are undecided."""

_log = logging.getLogger(__name__)


class Command(PolicyCommandSettings, ProveSettings):
    """Settings of `drone-rl prove`."""


def run(settings: Command, folder: Path) -> tuple[int, float]:
    """Verify a policy; return the exit status and the fraction of placements with success."""
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
        _log.info("resume with the same command and hydra.run.dir=%s", folder)
    return 0 if proof.is_proved else NOT_PROVED, proof.success
