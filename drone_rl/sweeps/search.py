"""The Optuna study of a hyperparameter search, in the sweep's folder.

The study is a journal file that all processes share; a search resumes its unfinished trials.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from drone_rl.utils.errors import InputError, extra
from drone_rl.utils.files import read_bytes
from drone_rl.utils.limits import JOURNAL_BYTES
from drone_rl.utils.run_result import RunResult

NAME = "sweep"
METRICS = {"running_reward": "running reward", "success": "success rate"}
"""What a search can maximize, with its name in text."""
_JOURNAL = "optuna.journal"
_DAMAGE = (LookupError, TypeError, ValueError, AttributeError, AssertionError, RecursionError)
"""Exceptions that Optuna raises for an inconsistent journal."""


def import_optuna() -> Any:
    """Return the module; raise an `InputError` if it isn't installed."""
    return extra("optuna", "optuna", "hydra/sweeper=optuna")


def study_folder(run: Path) -> Path:
    """Return the folder of the sweep that a run's folder is in."""
    return next((above for above in run.parents if (above / _JOURNAL).exists()), run.parent)


def open_study(folder: Path, direction: str | None = None) -> Any:
    """Return the `optuna.Study` in a sweep's folder; create it if `direction` is given.

    Raises:
        InputError: Optuna isn't installed, or the study's file is missing, damaged or too large.
    """
    optuna = import_optuna()
    path = folder / _JOURNAL
    if direction is None and not path.exists():
        raise InputError(f"{folder} has no search ({_JOURNAL}); leave out trial=")
    if path.exists() and path.stat().st_size:
        read_bytes(path, JOURNAL_BYTES)  # refuses a larger file, and what is no regular file
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    try:
        journal = optuna.storages.journal
        lock = journal.JournalFileOpenLock(str(path))  # the default is a link, refused in sweeps
        backend = journal.JournalFileBackend(str(path), lock)
        storage = optuna.storages.JournalStorage(backend)
        if direction is None:
            return optuna.load_study(study_name=NAME, storage=storage)
        return optuna.create_study(
            study_name=NAME, storage=storage, direction=direction, load_if_exists=True
        )
    except _DAMAGE as error:
        raise InputError(
            f"{path} is damaged ({type(error).__name__}: {str(error)[:100]}); move the folder away "
            "and search again"
        ) from error


def metric_of(study: Any) -> str:
    """Return what a study maximizes, one of `METRICS`."""
    return study.user_attrs.get("metric", "running_reward")


def next_trials(study: Any, space: Mapping[str, Any], count: int, seed: int) -> list[Any]:
    """Return the trials from the first to the last unfinished one, or else `count` new ones.

    They are `optuna.trial.FrozenTrial`s with consecutive numbers, in a space of Optuna's
    distributions by name. Each batch has its own seed, derived from the root seed, so that a
    resumed search samples the same.
    """
    optuna = import_optuna()
    left = [trial.number for trial in study.trials if not trial.state.is_finished()]
    if left:
        return study.trials[min(left) : max(left) + 1]
    begin = len(study.trials)
    study.sampler = optuna.samplers.TPESampler(seed=seed + begin, constant_liar=True)
    for _ in range(count):
        study.ask(dict(space))
    return study.trials[begin:]


def note_outcome(study: Any, number: int, result: RunResult | None) -> None:
    """Report the outcome of a trial: the value of the study's metric, pruned or failed."""
    states = import_optuna().trial.TrialState
    if study.trials[number].state != states.RUNNING:
        return
    by_success = metric_of(study) == "success"
    if result is None or (by_success and not result.confirming_flights):
        study.tell(number, state=states.FAIL)
    elif result.reason == "pruned":
        study.tell(number, state=states.PRUNED)
    elif by_success:
        study.tell(number, result.confirming_flights_succeeded / result.confirming_flights)
    else:
        study.tell(number, result.running_reward)
