"""Reports made of explanations, without running any policy."""

from collections.abc import Sequence
from pathlib import Path

from jinja2 import TemplateError

from drone_rl.explanations.report import write_report
from drone_rl.utils.errors import InputError
from drone_rl.utils.files import newest

_INCOMPLETE = (LookupError, TypeError, ValueError, AttributeError, ArithmeticError, TemplateError)
"""What becomes of a number that is missing or of another type, deep in the making of a report."""


def report(folders: Sequence[Path], target: Path) -> Path:
    """Makes a report, see `drone_rl.explanations.report.write_report`.

    Raises:
        InputError: An explanation can't be read or lacks something, or the report can't be written.
    """
    try:
        return write_report(folders, target)
    except InputError:
        raise
    except _INCOMPLETE as error:
        names = ", ".join(map(str, folders))
        raise InputError(
            f"explanations={names} do not hold what a report needs "
            f"({type(error).__name__}: {str(error)[:200]}); run drone-rl explain again"
        ) from error


def find_explanations(which: Sequence[str], outputs: str | Path = "outputs") -> list[Path]:
    """Folders of explanations.

    Args:
        which: Such folders, folders of them, or "latest" alone.
        outputs: Folder under which explanations are kept.

    Raises:
        InputError: There is none.
    """
    if tuple(which) != ("latest",):
        return [folder for path in which for folder in _explanations(Path(path))]
    made = Path(outputs).glob("explain/runs/*/*/explanation.json")
    run = newest({path.parents[1] for path in made})
    if run is None:
        raise InputError(
            f"explanations=latest, but there is none under {outputs}/explain; "
            "run drone-rl explain first or give folders"
        )
    return _explanations(run)


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
