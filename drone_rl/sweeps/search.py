"""Optuna's side of a search: a study in the sweep's folder, which its runs report to.

The study is a journal of its own in a file that all processes share, so it outlives every one of
them: a search that was killed goes on with the trials that it had begun.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from drone_rl.training import Callback
from drone_rl.utils.extras import extra

if TYPE_CHECKING:
    from drone_rl.training import Trainer

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


def tell(study: Any, number: int, result: Mapping[str, Any] | None) -> None:
    """Notes what became of a trial: its running mean of cubes, that it was pruned or failed."""
    optuna = import_optuna()
    if study.trials[number].state != optuna.trial.TrialState.RUNNING:
        return
    if result is None:
        study.tell(number, state=optuna.trial.TrialState.FAIL)
    elif result["reason"] == "pruned":
        study.tell(number, state=optuna.trial.TrialState.PRUNED)
    else:
        study.tell(number, result["running_cubes"])


class PruneCallback(Callback):
    """Stops a run whose running mean lies below the median of the others at the same frames."""

    def __init__(self, folder: Path, number: int) -> None:
        """Joins the study.

        Args:
            folder: Of the sweep.
            number: Of the trial.
        """
        study = open_study(folder)
        optuna = import_optuna()
        settings = study.user_attrs
        study.pruner = optuna.pruners.MedianPruner(n_startup_trials=settings["startup_trials"])
        self._trial = optuna.Trial(study, study.trials[number]._trial_id)
        self._frames = settings["report_frames"]
        self._prunes = settings["prune"]
        self._reported = set(study.trials[number].intermediate_values)

    def on_update(self, trainer: "Trainer", metrics: Mapping[str, float]) -> None:
        """Reports each time that so many frames have passed."""
        step = trainer.progress.frames // self._frames
        if step == 0 or step in self._reported:
            return
        self._reported.add(step)
        self._trial.report(trainer.progress.running_cubes, step)
        if self._prunes and self._trial.should_prune():
            trainer.stop_request = "pruned"
