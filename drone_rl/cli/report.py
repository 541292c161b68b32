"""`drone-rl report`."""

import dataclasses
import logging
from pathlib import Path
from typing import Annotated, Any

from drone_rl.config.commands import PathsSettings
from drone_rl.utils.schema import Listed
from drone_rl.utils.settings import Settings

_log = logging.getLogger(__name__)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Command(Settings):
    """What `drone-rl report` can be told."""

    explanations: Annotated[Any, Listed("folder")] = ("latest",)
    """Folders that hold an explanation.json, or latest for those of the newest explanation."""
    paths: PathsSettings = PathsSettings()
    """Folders."""


def run(settings: Command, folder: Path) -> tuple[int, str]:
    """Makes a report from explanations. Returns the exit status and the report's path."""
    from drone_rl.explanations.report.page import find_explanations, report

    made = report(find_explanations(settings.explanations, settings.paths.outputs), folder)
    _log.info("report: %s", made)
    return 0, str(made)
