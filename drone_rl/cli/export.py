"""`drone-rl export`."""

import dataclasses
import logging
from pathlib import Path
from typing import Annotated

import drone_rl
from drone_rl.hydra_app.names import policies as prepare  # noqa: F401 -- of what was typed
from drone_rl.settings.judging import FlightSettings
from drone_rl.settings.paths import PathsSettings
from drone_rl.utils.overrides import COMMAND

_log = logging.getLogger(__name__)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Command(FlightSettings):
    """What `drone-rl export` can be told."""

    policy: str = "latest"
    """Which policy, see `drone_rl.load_policy`."""
    name: str = "policy"
    """Name of the files."""
    command: Annotated[str, COMMAND] | None = None
    """The command that trained it, for the card; none names the run's own settings."""
    certificate: str | None = None
    """A proof's file for the card to quote; none takes the one that lies with the policy."""
    paths: PathsSettings = PathsSettings()
    """Folders."""


def run(settings: Command, folder: Path) -> tuple[int, str]:
    """Exports one policy. Returns the exit status and the file's path."""
    from drone_rl.api.exporting import export

    policy = drone_rl.load_policy(settings.policy, outputs=settings.paths.outputs)
    target = folder / f"{settings.name}.safetensors"
    given = settings.certificate
    export(policy, target, settings, command=settings.command, certificate=given)
    _log.info("written: %s and %s", target, target.with_suffix(".md").name)
    return 0, str(target)
