"""`drone-rl train`: one run, or the sweep of many, which needs none of the heavy libraries."""

import dataclasses
import functools
import logging
import signal
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import drone_rl
from drone_rl.cli.hydra import resuming
from drone_rl.cli.hydra.launchers import (
    LocalLauncher,
    OptunaSweeper,
    RayLauncher,
    SlurmLauncher,
    register_plugins,
)
from drone_rl.config.commands import PathsSettings
from drone_rl.config.training import Logger, Tensorboard, TrainSettings
from drone_rl.config.verification import ProvableSettings
from drone_rl.utils.schema import Instance, Several, Whole
from drone_rl.verification.text import found

if TYPE_CHECKING:
    from drone_rl.training import Callback

_log = logging.getLogger(__name__)
prepare = resuming.complete
"""What `drone_rl.cli.hydra.composition` does with what was typed."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Command(TrainSettings):
    """What `drone-rl train` can be told."""

    logger: Annotated[tuple[Logger, ...], Several(Instance(Logger), 0, 16)] = (Tensorboard(),)
    """Where metrics go besides metrics.csv."""
    paths: PathsSettings = PathsSettings()
    """Folders."""
    resume: str | None = None
    """Folder of a run to go on with (its own settings are taken over); none starts a new one."""
    provable: ProvableSettings = ProvableSettings()
    """How training goes on until nothing is left that the policy fails at."""
    trial: Annotated[int, Whole(0)] | None = None
    """Number of this run in the search of hydra/sweeper=optuna, which sets it; none for none."""


def _training(provable: ProvableSettings) -> Callable[..., Any]:
    """What trains: as usual, or until it is proved."""
    if not provable.rounds:
        return drone_rl.train
    return functools.partial(drone_rl.train_until_proved, how=provable)


def register() -> None:
    """Tells Hydra of the launchers and the sweeper."""
    register_plugins(LocalLauncher, SlurmLauncher, RayLauncher, OptunaSweeper)


def run(settings: Command, folder: Path) -> tuple[int, float]:
    """Trains one policy. Returns the exit status and the running mean of rewards."""
    train = _training(settings.provable)  # slow to import; a sweep leaves it to its runs
    from drone_rl.utils.progress import silent

    try:
        done = train(
            settings.narrowed(TrainSettings),
            folder=folder,
            resume=settings.resume is not None,
            callbacks=_callbacks(settings, folder),
            progress=silent,
        )
    except (KeyboardInterrupt, SystemExit) as stop:
        if "training" not in vars(stop):  # nothing was saved since the last checkpoint
            raise
        done = vars(stop)["training"]
    _log.info("run folder: %s", folder)
    for row in done.result.get("rounds", ()):
        _log.info(found(row))
    if not done.reason.startswith("SIG"):
        return 0, done.running_reward
    _log.info("go on with: %s", resuming.resume_command(folder))
    return 128 + signal.Signals[done.reason].value, done.running_reward


def _callbacks(settings: Command, folder: Path) -> list["Callback"]:
    """What is done besides learning. A run that is resumed is left as it is until it goes on."""
    from drone_rl.sweeps.pruning import PruneCallback
    from drone_rl.training import Callback, LoggerCallback, ProgressCallback

    class Note(Callback):
        """Notes the settings of a resumed run once its state has been accepted."""

        def on_start(self, training: object) -> None:
            resuming.note_settings(folder)

    def make() -> list[Any]:
        return [logger.make() for logger in settings.logger]

    searching = [] if settings.trial is None else [PruneCallback(folder.parent, settings.trial)]
    if settings.resume is None:
        return [LoggerCallback(make()), ProgressCallback(), *searching]
    resuming.check_folder(settings.resume, folder)
    return [LoggerCallback(make), Note(), ProgressCallback(), *searching]
