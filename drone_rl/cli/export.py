"""`drone-rl export`."""

import logging
from pathlib import Path
from typing import Annotated

import drone_rl
from drone_rl.cli.settings import CommandSettings
from drone_rl.config.commands import FlightSettings
from drone_rl.utils.errors import InputError
from drone_rl.utils.overrides import COMMAND
from drone_rl.utils.schema import FileName, OneOf
from drone_rl.utils.text import seed_line

_log = logging.getLogger(__name__)


class Command(CommandSettings, FlightSettings):
    """Settings of `drone-rl export`."""

    policy: str = "latest"
    """Policy: a .pt file, the folder of a run, or latest."""
    name: Annotated[str, FileName()] = "policy"
    """Name of the files, without extension."""
    format: Annotated[str, OneOf(("safetensors", "onnx"))] = "safetensors"
    """safetensors with a model card, or onnx, an ONNX model of RGB image to action
    probabilities."""
    command: Annotated[str, COMMAND] | None = None
    """Training command for the card; none takes the run's own settings."""
    certificate: str | None = None
    """Certificate file for the card; none takes the one next to the policy, if it matches."""
    shifts: str | None = None
    """File shifts.json for the card; none takes the one next to the policy, otherwise the newest
    under outputs/shifts of this network and task."""

    def check(self) -> None:
        """Refuse quotes for the card with an ONNX model, which has no card."""
        for name, given in (("certificate", self.certificate), ("shifts", self.shifts)):
            if self.format == "onnx" and given is not None:
                raise InputError(
                    f"{name} is for the card, which format=onnx has not; leave it out or use "
                    "format=safetensors"
                )


def run(settings: Command, folder: Path) -> tuple[int, str]:
    """Export one policy; return the exit status and the file's path."""
    from drone_rl.utils.seeding import root_seed  # imports torch
    from drone_rl.verdicts.export import export
    from drone_rl.verdicts.onnx_export import export_onnx

    policy = drone_rl.load_policy(settings.policy, outputs=settings.paths.outputs)
    target = folder / f"{settings.name}.{settings.format}"
    if settings.format == "onnx":
        seed = root_seed(settings.seed)
        found = export_onnx(policy, target, command=settings.command, seed=seed.value)
        difference = f"{found.difference:.1e} in {found.frames:,} images"
        _log.info("written: %s, which differs from PyTorch by at most %s", target, difference)
        _log.info("%s", seed_line(seed.as_dict()))
        return 0, str(target)
    seed = export(
        policy,
        target,
        settings,
        command=settings.command,
        certificate=settings.certificate,
        shifts=settings.shifts,
        outputs=settings.paths.outputs,
    )
    _log.info("written: %s and %s", target, target.with_suffix(".md").name)
    _log.info("%s", seed_line(seed.as_dict()))
    return 0, str(target)
