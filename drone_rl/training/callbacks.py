"""Callbacks of the training loop: checkpoints, logs, progress."""

import copy
import csv
import io
import logging
import math
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol

from torchrl.record.loggers import Logger

from drone_rl.config.training import DETERMINISTIC
from drone_rl.policies.zoo import TrainingProgress as TrainingProgress
from drone_rl.sim.tasks import Task
from drone_rl.training.metrics import success_metric
from drone_rl.utils.checkpoint import save_checkpoint
from drone_rl.utils.files import make_folder, write_atomically
from drone_rl.utils.progress import Progress, as_progress
from drone_rl.utils.readers import read_table
from drone_rl.utils.run_result import NAME
from drone_rl.utils.schema import Instance, Several


class OngoingTraining(Protocol):
    """The part of `Trainer` that callbacks use."""

    progress: TrainingProgress
    total_frames: int
    """Frames after which it stops."""
    stop_request: str
    """A callback's reason to stop after this update; empty to go on."""
    confirm: Callable[[int], bool] | None
    """Evaluates the policy greedily for `result.json`; see `Trainer`."""

    def state_dict(self) -> dict[str, Any]:
        """Return everything that the next update depends on."""
        ...


_SHARE = "reward_share/"
_log = logging.getLogger(__name__)
_MANY = 1000
"""Most callbacks of one training run."""


class Callback:
    """Hooks of the training loop; override those of interest."""

    def on_clone(self, epoch: int, epochs: int, metrics: Mapping[str, float]) -> None:
        """After each of the passes over the demonstrations of a new run, before `on_start`."""

    def on_start(self, training: OngoingTraining) -> None:
        """Before the first update of this process."""

    def on_update(self, training: OngoingTraining, metrics: Mapping[str, float]) -> None:
        """After each update."""

    def on_end(self, training: OngoingTraining, reason: str) -> None:
        """After the last update."""

    def on_failure(self, training: OngoingTraining) -> None:
        """When an update failed; the parameters are those before it."""


class CheckpointCallback(Callback):
    """Write the newest state (`last.pt`) and the one with the best running mean (`best.pt`).

    The mean starts at 0: where returns are negative, an early state may be the best by it.
    """

    def __init__(
        self,
        folder: str | Path,
        *,
        interval_s: float = 15.0,
        extra: Mapping[str, Any] | None = None,
    ) -> None:
        """Set the folder, the seconds between two checkpoints, and entries to add to each."""
        self.folder = Path(folder)
        self.last_path, self.best_path = self.folder / "last.pt", self.folder / "best.pt"
        self.interval_s = interval_s
        self.extra = dict(extra or {})
        self.best = float("-inf")
        self._best_state: dict[str, Any] | None = None
        self._saved_at = time.monotonic()

    def on_start(self, training: OngoingTraining) -> None:
        """Create the folder, and save if there is no last checkpoint."""
        make_folder(self.folder)
        if not self.last_path.exists():
            self._save(training)

    def on_update(self, training: OngoingTraining, metrics: Mapping[str, float]) -> None:
        """Keep the best state of all updates; save when the interval has passed."""
        if training.progress.running_reward > self.best:
            self.best = training.progress.running_reward
            self._best_state = copy.deepcopy(training.state_dict())
        if time.monotonic() - self._saved_at >= self.interval_s:
            self._save(training)

    def on_end(self, training: OngoingTraining, reason: str) -> None:
        """Save the final state."""
        self._save(training)

    def _save(self, training: OngoingTraining) -> None:
        shared = {"best": self.best, **self.extra}
        state = training.state_dict()
        # the best one first: a run that resumes from the last one saves better ones only
        if self._best_state is not None or not self.best_path.exists():
            save_checkpoint(self.best_path, {**(self._best_state or state), **shared})
            self._best_state = None
        save_checkpoint(self.last_path, {**state, **shared})
        self._saved_at = time.monotonic()


class CsvCallback(Callback):
    """Write a row of `metrics.csv` for each update; drop rows that a resumed run will repeat.

    Passes over demonstrations have their rows in `cloning.csv`.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)

    def on_clone(self, epoch: int, epochs: int, metrics: Mapping[str, float]) -> None:
        """Append a row to `cloning.csv`, which the first pass begins."""
        path = self.path.with_name("cloning.csv")
        if epoch == 1:
            path.unlink(missing_ok=True)
        _append_row(path, {"epoch": epoch}, metrics)

    def on_start(self, training: OngoingTraining) -> None:
        """Keep the rows up to the state that training resumes from."""
        if not self.path.exists():
            return
        rows = [*read_table(self.path)] if self.path.stat().st_size else []
        whole = [r for r in rows[1:] if len(r) == len(rows[0])]  # the last may be cut short
        last = training.progress.updates
        kept = [r for r in whole if r[0].isdecimal() and int(r[0]) <= last]
        text = io.StringIO(newline="")
        csv.writer(text).writerows(rows[:1] + kept if kept else [])  # `on_update` writes the header
        write_atomically(self.path, text.getvalue())

    def on_update(self, training: OngoingTraining, metrics: Mapping[str, float]) -> None:
        """Append a row; delete result.json, which is of the training before this update."""
        self.path.with_name(NAME).unlink(missing_ok=True)
        done = training.progress
        counters = {"update": done.updates, "frames": done.frames, "episodes": done.episodes}
        _append_row(self.path, {**counters, "seconds": round(done.seconds, 3)}, metrics)

    def on_end(self, training: OngoingTraining, reason: str) -> None:
        """Write only a header if there was no update, as in a run that only clones."""
        if not self.path.exists() or self.path.stat().st_size == 0:
            self.path.write_text("update,frames,episodes,seconds,train/running_reward\n")


def _append_row(path: Path, counters: Mapping[str, float], metrics: Mapping[str, float]) -> None:
    """Append a row to a table, which begins with the names of its columns."""
    is_new = not path.exists() or path.stat().st_size == 0
    with path.open("a", newline="") as file:
        writer = csv.writer(file)
        if is_new:
            writer.writerow([*counters, *metrics])
        writer.writerow([*counters.values(), *(f"{v:.6g}" for v in metrics.values())])


class CollapseCheck(Callback):
    """Warn once that learning has collapsed: a deterministic policy that does not improve.

    Its actions hardly vary any more, so that it can learn nothing new, and its reward is clearly
    below the target.
    """

    EPISODES = 500
    """Episodes without improvement before the warning: five memories of the running reward."""
    UPDATES = 20
    """Least number of their updates."""
    CLOSE = 0.9
    """Fraction of the target, or success rate in a batch, from which a policy is good enough."""
    STEP = 0.01
    """Fraction of the target by which the running reward must rise to count as improvement."""

    def __init__(self, target: float | None, success: str) -> None:
        """Take the running reward at which the task counts as solved, and what measures success.

        `target` is None if it is unknown; `success` is a name, see `success_metric`.
        """
        self._success = success
        self._target, self._best = target, float("-inf")
        self._since = (0, 0)
        """Episodes and updates at the last sign of learning."""
        self.collapsed_at: int | None = None
        """Frames at the warning, if there was one."""

    def on_start(self, training: OngoingTraining) -> None:
        """Count from here, also in a resumed run."""
        self._since = training.progress.episodes, training.progress.updates

    def on_update(self, training: OngoingTraining, metrics: Mapping[str, float]) -> None:
        """Count the episodes since the policy last varied or improved."""
        progress = training.progress
        # continuous actions have densities, whose entropy is also below 0
        is_deterministic = abs(metrics.get("loss/entropy", 1.0)) < DETERMINISTIC
        is_better = progress.running_reward > self._best + self.STEP * (self._target or 0.0)
        self._best = progress.running_reward if is_better else self._best
        if self._target is None:
            is_close = metrics.get(self._success, 0.0) >= self.CLOSE
        else:
            is_close = progress.running_reward >= self.CLOSE * self._target
        if is_better or is_close or not is_deterministic:
            self._since = progress.episodes, progress.updates
        episodes, updates = progress.episodes - self._since[0], progress.updates - self._since[1]
        is_over = episodes >= self.EPISODES and updates >= self.UPDATES
        if is_over and self.collapsed_at is None:
            self.collapsed_at = progress.frames
            _log.warning(
                "learning has collapsed: for %d episodes the policy has been deterministic "
                "(entropy below %g) and not improved (running reward %.2f); stop and try a lower "
                "optimizer.lr, a higher objective.entropy_coeff or another seed",
                *(episodes, DETERMINISTIC, progress.running_reward),
            )


class WidenRanges(Callback):
    """Widen the ranges of a task's `Curriculum` as success rises."""

    def __init__(self, tasks: Sequence[Task[Any]], *, is_new: bool) -> None:
        """Take the task of each group of environments, and whether the training is a new one."""
        self._curricula = [task.curriculum for task in tasks]
        self._success = success_metric(tasks[0])
        if is_new:
            for curriculum in self._curricula:
                curriculum.load((0.0, 0.0))

    def on_update(self, training: OngoingTraining, metrics: Mapping[str, float]) -> None:
        """Note the success of the episodes that end in a batch, if any do."""
        success, (first, *others) = metrics[self._success], self._curricula
        if not math.isnan(success) and first.note(success):
            _log.info("curriculum: level %.1f of 1", first.level)
            for curriculum in others:
                curriculum.load(first.state())


class UnpaidTerms(Callback):
    """Warn once of reward terms that no episode was paid."""

    EPISODES = 200
    """Episodes before the warning."""

    def __init__(self) -> None:
        """Count from here, also in a resumed run."""
        self._unpaid: set[str] | None = None
        self._episodes = 0

    def on_update(self, training: OngoingTraining, metrics: Mapping[str, float]) -> None:
        """Note the terms that are paid; `reward_share/NAME` is logged of several terms."""
        unpaid = {k.partition("/")[2] for k, v in metrics.items() if k.startswith(_SHARE) and not v}
        if self._unpaid is None:
            self._unpaid, self._episodes = unpaid, training.progress.episodes
        if not self._unpaid:
            return
        self._unpaid &= unpaid
        if self._unpaid and training.progress.episodes - self._episodes >= self.EPISODES:
            _log.warning(
                "none of %d episodes was paid the reward terms %s; normal before a first success, "
                "otherwise check their functions and parameters",
                training.progress.episodes - self._episodes,
                ", ".join(sorted(self._unpaid)),
            )
            self._unpaid = set()


class LoggerCallback(Callback):
    """Pass the metrics, by frames, to TorchRL's loggers."""

    def __init__(self, loggers: Sequence[Logger] | Callable[[], Sequence[Logger]]) -> None:
        """Set the loggers, or a function that makes them once a resumed run is accepted."""
        self._make = loggers if callable(loggers) else None
        self.loggers = [] if callable(loggers) else list(loggers)

    def on_start(self, training: OngoingTraining) -> None:
        """Make the loggers, unless cloning has made them."""
        self._open()

    def _open(self) -> None:
        if self._make is not None:
            self.loggers, self._make = list(self._make()), None

    def on_clone(self, epoch: int, epochs: int, metrics: Mapping[str, float]) -> None:
        """Log each metric, by epochs."""
        self._open()
        for logger in self.loggers:
            for name, value in metrics.items():
                logger.log_scalar(name, value, step=epoch)

    def on_update(self, training: OngoingTraining, metrics: Mapping[str, float]) -> None:
        """Log each metric."""
        for logger in self.loggers:
            for name, value in metrics.items():
                logger.log_scalar(name, value, step=training.progress.frames)


def with_progress(callbacks: Sequence[Callback], progress: Progress | None) -> list[Callback]:
    """Return given callbacks and one that forwards the progress, by default to a bar.

    Raises:
        InputError: They are no callbacks, or `progress` is no function.
    """
    callbacks = Several(Instance(Callback), 0, _MANY).read(callbacks, "callbacks")
    return [*callbacks, ForwardProgress(as_progress(progress))]


class ForwardProgress(Callback):
    """Forward the progress of a training run to a `drone_rl.utils.progress.Progress`."""

    def __init__(self, progress: Progress) -> None:
        self.progress = progress

    def on_clone(self, epoch: int, epochs: int, metrics: Mapping[str, float]) -> None:
        """Forward the accuracy and the epochs."""
        self.progress(f"cloning: accuracy {metrics['cloning/accuracy']:.3f}", epoch, epochs)

    def on_update(self, training: OngoingTraining, metrics: Mapping[str, float]) -> None:
        """Forward the running mean and the frames."""
        done = training.progress
        text = f"running reward {done.running_reward:.2f}, {done.episodes} episodes"
        total = max(training.total_frames, done.frames + 1)  # `on_end` reports the end
        self.progress(text, done.frames, total)

    def on_end(self, training: OngoingTraining, reason: str) -> None:
        """Forward the reason why it stopped, unless it only cloned."""
        if frames := training.progress.frames:
            self.progress(f"stopped: {reason}", frames, frames)

    def on_failure(self, training: OngoingTraining) -> None:
        """Forward that it failed."""
        self.on_end(training, "failed")
