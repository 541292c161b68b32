"""`drone-rl sweep-report`."""

import dataclasses
import logging
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

from drone_rl.config.commands import PathsSettings
from drone_rl.utils.schema import Whole
from drone_rl.utils.settings import Settings

_log = logging.getLogger(__name__)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Command(Settings):
    """What `drone-rl sweep-report` can be told."""

    folder: str = "latest"
    """Folder of the sweep, or latest for the newest one."""
    picture: str | None = None
    """PNG to write, too, of what policies came out, lost sides and entropies; none for none."""
    judge: bool = False
    """Whether to judge the last.pt of every finished run again, by the present rule."""
    episodes: Annotated[int, Whole(1, unit="episodes")] = 200
    """Episodes of such a verdict, in worlds to choose by."""
    device: str = "cpu"
    """Where these are flown: cpu, cuda or cuda:N."""
    paths: PathsSettings = PathsSettings()
    """Folders."""


def prepare(overrides: Sequence[str]) -> list[str]:
    """Makes `drone-rl sweep-report FOLDER` mean `folder=FOLDER`."""
    from drone_rl.sweeps.runs import quoted

    return [
        o if "=" in o.split("/")[0] or o.startswith("-") else f"folder={quoted(o)}"
        for o in overrides
    ]


def run(settings: Command, folder: Path) -> tuple[int, None]:
    """Reports on a sweep, finished or not. Returns the exit status."""
    from drone_rl.sweeps.report import find_sweep, judge_sweep, report_sweep, write_picture

    del folder
    sweep = find_sweep(settings.folder, settings.paths.outputs)
    if settings.judge:
        judge_sweep(sweep, settings.episodes, settings.device)
    page, lines = report_sweep(sweep)
    print(lines)
    if settings.picture is not None:
        write_picture(sweep, Path(settings.picture))
        _log.info("picture: %s", settings.picture)
    _log.info("written: %s", page)
    return 0, None
