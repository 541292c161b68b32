"""`drone-rl report`."""

import logging
from pathlib import Path

from hydra.core.hydra_config import HydraConfig
from jinja2 import TemplateError
from omegaconf import DictConfig, ListConfig

from drone_rl.report import write_report
from drone_rl.utils.errors import InputError

_INCOMPLETE = (LookupError, TypeError, ValueError, AttributeError, ArithmeticError, TemplateError)
"""What becomes of a number that is missing or of another type, deep in the making of a report."""
_log = logging.getLogger(__name__)


def run(config: DictConfig) -> tuple[int, str]:
    """Makes a report from explanations. Returns the exit status and the report's path."""
    folders = _folders(config.explanations, Path(config.paths.outputs))
    try:
        report = write_report(folders, Path(HydraConfig.get().runtime.output_dir))
    except InputError:
        raise
    except _INCOMPLETE as error:
        raise InputError(
            f"explanations={config.explanations} do not hold what a report needs "
            f"({type(error).__name__}: {str(error)[:200]}); run drone-rl explain again"
        ) from error
    _log.info("report: %s", report)
    return 0, str(report)


def _folders(which: str | ListConfig, outputs: Path) -> list[Path]:
    if which != "latest":
        given = [Path(p) for p in ([which] if isinstance(which, str) else which)]
        return [folder for path in given for folder in _explanations(path)]
    runs = sorted(
        {path.parents[1] for path in outputs.glob("explain/runs/*/*/explanation.json")},
        key=lambda run: run.stat().st_mtime,
    )
    if not runs:
        raise InputError(
            f"explanations=latest, but there is none under {outputs}/explain; "
            "run drone-rl explain first or give folders"
        )
    return _explanations(runs[-1])


def _explanations(folder: Path) -> list[Path]:
    """The folder itself or, for that of a whole command, all explanations in it."""
    if (folder / "explanation.json").is_file():
        return [folder]
    found = sorted(path.parent for path in folder.glob("*/explanation.json"))
    if not found:
        raise InputError(
            f"explanations={folder} holds no explanation.json; give a folder that drone-rl explain "
            "wrote"
        )
    return found
