"""Optuna's side of a search: a study in the sweep's folder, which its runs report to.

The study is a journal of its own in a file that all processes share, so it outlives every one of
them: a search that was killed goes on with the trials that it had begun.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from drone_rl.utils.errors import InputError, extra
from drone_rl.utils.files import parse_json, read_bytes
from drone_rl.utils.limits import JOURNAL_BYTES
from drone_rl.utils.schema import Whole, as_mapping

NAME = "sweep"
_OPERATIONS = Whole(0, 100)
"""Optuna's numbers of what a line of its journal does."""
_DAMAGE = (LookupError, TypeError, ValueError, AttributeError, AssertionError)
"""What Optuna raises where the lines of a journal do not follow from each other."""


def import_optuna() -> Any:
    """The module.

    Raises:
        InputError: It isn't installed.
    """
    return extra("optuna", "optuna", "hydra/sweeper=optuna")


def open_study(folder: Path, **settings: Any) -> Any:
    """The study in a sweep's folder; made if there is none and `direction` is given.

    Args:
        folder: Of the sweep.
        settings: What `optuna.create_study` takes besides.

    Returns:
        An `optuna.Study`.

    Raises:
        InputError: Optuna isn't installed, or the study's file is damaged or too large.
    """
    optuna = import_optuna()
    path = folder / "optuna.journal"
    _check_journal(path)
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    try:
        backend = optuna.storages.journal.JournalFileBackend(str(path))
        storage = optuna.storages.JournalStorage(backend)
        named = {"study_name": NAME, "storage": storage, **settings}
        if "direction" not in settings:
            return optuna.load_study(**named)
        return optuna.create_study(load_if_exists=True, **named)
    except _DAMAGE as error:
        raise InputError(
            f"{path} is damaged ({type(error).__name__}: {str(error)[:100]}); move the folder away "
            "and search again"
        ) from error


def _check_journal(path: Path) -> None:
    """Refuses a journal that is too large, or whose lines are no operations.

    Raises:
        InputError: It is.
    """
    if not path.exists() or (path.is_file() and path.stat().st_size == 0):
        return
    content = read_bytes(path, JOURNAL_BYTES)
    *lines, _ = content.split(b"\n")  # a run may be writing the last one
    try:
        for number, line in enumerate(lines, start=1):
            entry = as_mapping(parse_json(line, f"line {number}", allow_nan=True), f"line {number}")
            _OPERATIONS.read(entry.get("op_code"), f"line {number}: op_code")
    except InputError as error:
        raise InputError(
            f"{path} is damaged ({error}); move the folder away and search again"
        ) from None


def next_trials(study: Any, space: Mapping[str, Any], count: int, seed: int) -> list[Any]:
    """The trials that a killed search left unfinished, or else new ones.

    Args:
        study: From `open_study`.
        space: Optuna's distributions by name.
        count: How many new ones at most.
        seed: Root of the draws; each batch has a seed of its own, so that a killed search draws
            what it would have drawn.

    Returns:
        `optuna.trial.FrozenTrial`s with consecutive numbers.
    """
    optuna = import_optuna()
    running = optuna.trial.TrialState.RUNNING
    left = [trial.number for trial in study.trials if trial.state == running]
    if left:
        return study.trials[min(left) : max(left) + 1]
    begin = len(study.trials)
    study.sampler = optuna.samplers.TPESampler(seed=seed + begin, constant_liar=True)
    for _ in range(count):
        study.ask(dict(space))
    return study.trials[begin:]


def note_outcome(study: Any, number: int, result: Mapping[str, Any] | None) -> None:
    """Notes what became of a trial: its running mean of rewards, that it was pruned or failed."""
    optuna = import_optuna()
    if study.trials[number].state != optuna.trial.TrialState.RUNNING:
        return
    if result is None:
        study.tell(number, state=optuna.trial.TrialState.FAIL)
    elif result["reason"] == "pruned":
        study.tell(number, state=optuna.trial.TrialState.PRUNED)
    else:
        study.tell(number, float(result["running_reward"]))
