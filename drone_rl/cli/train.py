"""`drone-rl train`: one run, or a sweep, whose own process imports no heavy libraries."""

import functools
import logging
import signal
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import drone_rl
from drone_rl.cli.hydra import resuming
from drone_rl.cli.settings import CommandSettings
from drone_rl.config.commands import ProvableSettings
from drone_rl.config.parts import Parts
from drone_rl.config.training import Logger, Tensorboard, TrainSettings
from drone_rl.config.values import Seed
from drone_rl.utils.errors import InputError
from drone_rl.utils.progress import bar_or_lines
from drone_rl.utils.run_result import read_result
from drone_rl.utils.text import render

if TYPE_CHECKING:
    from drone_rl.training import Callback

_log = logging.getLogger(__name__)
_TRAIN_LONGER = {
    "frames": "to train longer, give a larger trainer.total_frames",
    "episodes": "to train longer, give a larger trainer.total_episodes",
    "solved": "to train longer, give a larger trainer.target_share or trainer.confirm_share",
}
"""What to do about a run that has stopped, by the reason."""


class TrainCommand(CommandSettings, TrainSettings):
    """Train a policy that sees camera images, in a task: collect cubes, reach a goal or others."""

    logger: Annotated[tuple[Logger, ...], Parts(Logger, 16)] = (Tensorboard(),)
    """Loggers in addition to metrics.csv."""
    resume: str | None = None
    """Folder of a run to resume with its own settings, or latest for the newest run; null starts a
    new one."""
    provable: ProvableSettings = ProvableSettings()
    """Training in rounds until a proof succeeds, if provable.rounds is above 0."""
    trial: Seed | None = None
    """Number of this run in a search, which hydra/sweeper=optuna sets; null for no search."""

    def check(self) -> None:
        """Refuse a new run that would learn nothing."""
        super().check()
        if not self.trainer.total_frames and self.demonstrations is None and self.resume is None:
            raise InputError(
                "trainer.total_frames=0 trains nothing; give 1 or more, or demonstrations to clone"
            )

    @classmethod
    def prepare(cls, overrides: Sequence[str]) -> list[str]:
        """Return the complete command line."""
        return resuming.complete(overrides)

    def used_policy(self, folder: Path) -> str:
        """Return the folder of the run."""
        return str(folder)

    def run(self, folder: Path) -> tuple[int, float]:
        """Train one policy; return the exit status and the running mean of rewards."""
        before = read_result(folder) if self.resume is not None else None
        train = drone_rl.train  # slow to import; not needed by a sweep
        if self.provable.rounds:
            train = functools.partial(drone_rl.train_until_proved, how=self.provable)
        try:
            training = train(
                self.as_base(TrainSettings),
                folder=folder,
                resume=self.resume is not None,
                callbacks=_callbacks(self, folder),
                progress=bar_or_lines(),
            )
        except (KeyboardInterrupt, SystemExit) as stop:
            if "training" not in vars(stop):  # nothing was saved since the last checkpoint
                raise
            training = vars(stop)["training"]
        _log.info("%s", training)
        for row in training.result.rounds:
            _log.info(render("drone_rl.verification", "round.j2", **dict(row)))
        if not training.result.is_interrupted:
            if before is not None and before.frames == training.result.frames:
                _log.info(
                    "the run is already finished (%s, %s frames); %s",
                    *(training.reason, f"{training.result.frames:,}"),
                    _TRAIN_LONGER.get(training.reason, "start a new one"),
                )
            return 0, training.running_reward
        _log.info("resume with: %s", resuming.resume_command(folder))
        return 128 + signal.Signals[training.reason].value, training.running_reward


def _callbacks(settings: TrainCommand, folder: Path) -> list["Callback"]:
    """Return the callbacks. A resumed run's files stay unchanged until its state is accepted."""
    from drone_rl.sweeps.pruning import TrialCallback
    from drone_rl.sweeps.search import study_folder
    from drone_rl.training import Callback, LoggerCallback

    class WriteSettings(Callback):
        def on_start(self, training: object) -> None:
            resuming.note_settings(folder)

    def make() -> list[Any]:
        return [logger.make() for logger in settings.logger]

    trial = settings.trial
    searching = [] if trial is None else [TrialCallback(study_folder(folder), trial)]
    if settings.resume is None:
        return [LoggerCallback(make()), *searching]
    resuming.check_folder(settings.resume, folder)
    return [LoggerCallback(make), WriteSettings(), *searching]
