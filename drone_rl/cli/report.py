"""`drone-rl report`."""

import logging
from pathlib import Path
from typing import Annotated, Any

from drone_rl.cli.settings import CommandSettings
from drone_rl.utils.schema import Listed

_log = logging.getLogger(__name__)


class Command(CommandSettings):
    """Settings of `drone-rl report`."""

    explanations: Annotated[Any, Listed("folder")] = ("latest",)
    """Folder with an explanation.json, or a list of folders that one report compares; latest for
    those of the newest explanation."""


def run(settings: Command, folder: Path) -> tuple[int, str]:
    """Write a report from explanations; return the exit status and the report's path."""
    from drone_rl.explanations.report.page import find_explanations, report

    made = report(find_explanations(settings.explanations, settings.paths.outputs), folder)
    _log.info("report: %s", made)
    return 0, str(made)
