"""What a run of an Optuna search does: prune itself if unpromising, or evaluate its last policy."""

from collections.abc import Mapping
from pathlib import Path

from drone_rl.sweeps.search import import_optuna, metric_of, open_study
from drone_rl.training import Callback
from drone_rl.training.callbacks import OngoingTraining


class TrialCallback(Callback):
    """Stops a run whose running mean is below the median of the others at the same frames.

    A search for success prunes no run, and its runs evaluate their last policy.
    """

    def __init__(self, folder: Path, number: int) -> None:
        """Open the study in a sweep's folder; `number` is that of the trial."""
        study = open_study(folder)
        optuna = import_optuna()
        settings = study.user_attrs
        study.pruner = optuna.pruners.MedianPruner(n_startup_trials=settings["startup_trials"])
        self._trial = optuna.Trial(study, study.trials[number]._trial_id)
        self._frames = settings["report_frames"]
        self._by_success = metric_of(study) == "success"
        self._prunes = settings["prune"] and not self._by_success
        self._reported = set(study.trials[number].intermediate_values)

    def on_update(self, training: OngoingTraining, metrics: Mapping[str, float]) -> None:
        """Report the running mean every `report_frames` frames."""
        step = training.progress.frames // self._frames
        if step == 0 or step in self._reported:
            return
        self._reported.add(step)
        self._trial.report(training.progress.running_reward, step)
        if self._prunes and self._trial.should_prune():
            training.stop_request = "pruned"

    def on_end(self, training: OngoingTraining, reason: str) -> None:
        """Evaluate the last policy in confirmation episodes; a solved run has done so."""
        if self._by_success and reason in ("frames", "episodes") and training.confirm is not None:
            training.confirm(training.progress.updates)
