"""Optuna's side of a search: a study in the sweep's folder, which its runs report to.

The study is a journal of its own in a file that all processes share, so it outlives every one of
them: a search that was killed goes on with the trials that it had begun.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from drone_rl.utils.extras import extra

NAME = "sweep"


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
        InputError: Optuna isn't installed.
    """
    optuna = import_optuna()
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    backend = optuna.storages.journal.JournalFileBackend(str(folder / "optuna.journal"))
    storage = optuna.storages.JournalStorage(backend)
    if "direction" not in settings:
        return optuna.load_study(study_name=NAME, storage=storage, **settings)
    return optuna.create_study(study_name=NAME, storage=storage, load_if_exists=True, **settings)


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
