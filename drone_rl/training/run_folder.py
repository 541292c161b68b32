"""The folder of a training run: its files and its result."""

import contextlib
import dataclasses
import enum
import logging
import math
import signal
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, Self

import yaml

from drone_rl.config.configuration import (
    check_same_config,
    from_arguments,
)
from drone_rl.config.training import CloningSettings, TrainSettings
from drone_rl.policies.policy import Policy, load_policy
from drone_rl.policies.zoo import Checkpoint, describe, read_checkpoint
from drone_rl.sim.actions import Actions
from drone_rl.sim.tasks import Task, as_settings, as_task
from drone_rl.training.callbacks import CheckpointCallback, CollapseCheck, TrainingProgress
from drone_rl.training.confirmation import Confirmation
from drone_rl.training.demonstrations import Demonstration, FlightConditions, read_demonstrations
from drone_rl.training.restore import check_fits
from drone_rl.training.trainer import Trainer
from drone_rl.utils.display import Result, picture, table
from drone_rl.utils.errors import InputError
from drone_rl.utils.files import (
    as_path,
    folder_lock,
    last_of,
    make_folder,
    new_run_folder,
    write_atomically,
)
from drone_rl.utils.models import Model
from drone_rl.utils.provenance import provenance
from drone_rl.utils.readers import read_metrics
from drone_rl.utils.run_result import NAME, Cloning, RunResult
from drone_rl.utils.schema import shown

_log = logging.getLogger(__name__)
_EPISODES_PER_CONFIRMED = 10
"""Episodes of training for each of a confirmation, where no running reward calls for one."""
MAY_CHANGE = (
    "trainer.total_frames",
    "trainer.total_episodes",
    "trainer.target_share",
    "trainer.confirm_episodes",
    "trainer.confirm_share",
    "trainer.confirm_interval",
    "trainer.checkpoint_interval_s",
    "evaluate_after",
    "renderer",
    "demonstrations",
)
"""Settings that a resumed run may change: they don't enter into what is learned."""


@dataclasses.dataclass(frozen=True)
class Training(Result):
    """Result of a training run."""

    folder: Path
    result: RunResult
    """Content of `result.json`."""

    @property
    def reason(self) -> str:
        """Why it stopped, see `RunResult.reason`."""
        return self.result.reason

    @property
    def running_reward(self) -> float:
        """Running mean of the episodes' rewards at the end."""
        return self.result.running_reward

    @property
    def policy(self) -> Policy:
        """The last policy."""
        return load_policy(self.folder)

    def metrics(self) -> dict[str, list[float]]:
        """Return the columns of `metrics.csv`: one value for each update."""
        return read_metrics(self.folder)

    def __str__(self) -> str:
        result = self.result
        verdict = f", verdict: {result.verdict.kind}" if result.verdict else ""
        return (
            f"stopped ({self.reason}) after {result.frames:,} frames, "
            f"{result.episodes:,} episodes, {result.seconds:.1f} s: "
            f"running reward {self.running_reward:.3f}{verdict}; {self.folder}"
        )

    def _repr_html_(self) -> str:
        from matplotlib.figure import Figure  # slow to import; only a notebook needs it

        columns = self.metrics()
        figure = Figure(figsize=(6, 3), layout="constrained")
        axes = figure.add_subplot(xlabel="frames", ylabel="running mean of rewards")
        axes.plot(columns["frames"], columns["train/running_reward"])
        values = [(k, v) for k, v in self.result if isinstance(v, str | int | float)]
        rows = [[k, f"{v:.4g}" if isinstance(v, float) else str(v)] for k, v in values]
        return table(["training", str(self.folder)], rows) + picture(figure)


class RunFolder:
    """The folder of one run; `drone_rl.training.train.learn` shows the order of the calls."""

    def __init__(self, path: Path) -> None:
        self.path = path

    @classmethod
    def open(cls, path: str | Path | None, resume: bool) -> tuple[Self, Checkpoint | None]:
        """Return the folder and, to resume, its newest checkpoint.

        Raises:
            InputError: The folder holds a run that would be lost, or has no checkpoint to resume
                from, or an argument is missing or has the wrong type.
        """
        if not isinstance(resume, bool):
            raise InputError(
                f"resume={shown(resume)} is neither true nor false; give folder=RUN, resume=True"
            )
        if resume and path is None:
            raise InputError("resume=True needs the run to resume; give folder=RUN")
        folder = new_run_folder("train") if path is None else as_path(path, "folder")
        if resume and folder.suffix == ".pt":  # what load_policy takes
            raise InputError(
                f"folder={folder} is a checkpoint; give the folder of its run, the one with "
                "metrics.csv"
            )
        if resume:
            return cls(folder), read_checkpoint(last_of(folder))
        is_finished = (folder / NAME).exists()
        if is_finished or last_of(folder).exists():
            kind = "a finished" if is_finished else "an unfinished"
            raise InputError(
                f"folder={folder} holds {kind} run, which a new one would replace; resume it "
                "(in Python resume=True, else resume=FOLDER), delete it or give another folder"
            )
        return cls(folder), None

    @contextlib.contextmanager
    def locked(self, *, is_new: bool) -> Iterator[None]:
        """Make the folder and keep other processes out of it.

        Raises:
            InputError: It can't be made, another process uses it, or one has meanwhile left a run
                there that a new run would replace.
        """
        make_folder(self.path)
        with folder_lock(self.path):
            if is_new:
                self.open(self.path, resume=False)
            yield

    def prepare(self, settings: TrainSettings, state: Checkpoint | None) -> list[Demonstration]:
        """Check the checkpoint's settings; return the demonstrations that a new run clones, if any.

        Raises:
            InputError: The checkpoint has other settings, a demonstration is unusable, or there are
                demonstrations for a recurrent policy or for resuming a run that began without any.
        """
        folder, demonstrations = settings.demonstrations, []
        if state is not None:
            saved = TrainSettings.read(_own(state.config))
            check_same_config(saved.config(), settings.config(), MAY_CHANGE)
            if folder is not None and "cloning" not in state.training:
                raise InputError(
                    f"can't resume with demonstrations={folder}: the run was started without any, "
                    "and only a new run clones; leave them out or start a new run"
                )
        elif folder is not None:
            if describe(settings).is_recurrent:
                raise InputError(
                    "network=lstm remembers earlier frames, and cloning learns from single ones; "
                    "set another network=..."
                )
            demonstrations = read_demonstrations(folder, FlightConditions.of(settings))
        elif settings.cloning != CloningSettings():
            _log.warning("settings of cloning have no effect without demonstrations=FOLDER")
        return demonstrations

    def checkpoints(self, settings: TrainSettings) -> CheckpointCallback:
        """Return the callback that writes checkpoints, with the settings and their origin."""
        config, origin = settings.config(), provenance()
        description = describe(settings).model_dump(mode="json")
        return CheckpointCallback(
            self.path / "checkpoints",
            interval_s=settings.trainer.checkpoint_interval_s,
            extra={"config": config, "description": description, "provenance": origin},
        )

    def resume(
        self, trainer: Trainer, checkpoints: CheckpointCallback, state: Checkpoint | None
    ) -> None:
        """Load the state, if any, and write `run.yaml`; see `Trainer.load_state_dict`."""
        if state is not None:
            saved = state.training
            trainer.load_state_dict(saved)
            check_fits(saved.get("best"), checkpoints.best, "best")
            checkpoints.best = saved["best"]
            if "cloning" in saved:
                cloning = Cloning.read(saved["cloning"], "the checkpoint's cloning")
                checkpoints.extra["cloning"] = cloning.model_dump()
        extra = checkpoints.extra
        noted = {"config": extra["config"], "description": extra["description"]}
        text = yaml.safe_dump({**noted, **extra["provenance"]}, sort_keys=False)
        write_atomically(self.path / "run.yaml", text)


@dataclasses.dataclass(frozen=True)
class Judge:
    """What judges the last policy of a run; `drone_rl.train` takes that of `drone_rl.trust`."""

    check: Callable[[Task[Any], Actions], None]
    """Raises an `InputError` if it can't judge policies in a task, with such actions."""
    verdict: Callable[[Path, int, str, str], tuple[Model, TrainingProgress]]
    """Takes a checkpoint, number of episodes, device and renderer; returns the verdict and the
    checkpoint's progress."""


def check_judge(settings: TrainSettings, judge: Judge | None) -> None:
    """Refuse, before the training, a task that the verdict after it would refuse."""
    if not settings.evaluate_after:
        return
    setting = f"evaluate_after={settings.evaluate_after}"
    if judge is None:
        raise InputError(f"{setting} needs a judge; give judge=, as drone_rl.train does")
    try:
        judge.check(as_task(settings.task), describe(settings).make_dynamics().actions)
    except InputError as error:
        raise InputError(f"{setting}: {error}; or give evaluate_after=0") from None


def possible_ends(settings: TrainSettings) -> list[enum.IntEnum]:
    """Return why episodes may end; in computer-vision mode no drone loses control."""
    is_calm = settings.dynamics.is_computer_vision
    ends = as_task(settings.task).ends
    return [end for end in ends if not (is_calm and end.name == "LOST_CONTROL")]


def target_of(settings: TrainSettings) -> float | None:
    """Return the running reward at which a run is solved; None if none is known or wanted.

    Raises:
        InputError: It is a fraction of a largest reward that is not above 0 and finite, as are all
            figures.
    """
    share, largest = settings.trainer.target_share, as_task(settings.task).largest_reward
    if largest is None:
        return None
    if not 0 < largest < math.inf:
        raise InputError(
            f"task={settings.task.name} has largest_reward={largest:g}, of which no fraction is a "
            "target; give a finite one above 0, as by a reward for success"
        )
    return share and share * largest


def confirm_interval_of(settings: TrainSettings) -> int | None:
    """Return the updates between confirmations; None for no confirmations.

    By default they are a tenth of all episodes in a task whose largest reward is unknown.
    """
    trainer = settings.trainer
    if trainer.target_share is None or not trainer.confirm_episodes:
        return None
    if trainer.confirm_interval is not None:
        return trainer.confirm_interval
    if as_task(settings.task).largest_reward is not None:
        return 1
    episodes = _EPISODES_PER_CONFIRMED * trainer.confirm_episodes
    return math.ceil(episodes / settings.collector.num_envs)


def result_of(
    trainer: Trainer,
    settings: TrainSettings,
    confirmation: Confirmation | None,
    checkpoints: CheckpointCallback,
    collapse: CollapseCheck,
) -> RunResult:
    """Return the content of `result.json`."""
    return RunResult(
        reason=trainer.reason,
        **dataclasses.asdict(trainer.progress),
        largest_reward=as_task(settings.task).largest_reward,
        **({} if confirmation is None else confirmation.result),
        collapsed_at_frames=collapse.collapsed_at,
        cloning=checkpoints.extra.get("cloning"),
    )


def finish(
    settings: TrainSettings, folder: Path, result: RunResult, judge: Judge | None
) -> Training:
    """Judge the last policy if settings request it and no signal came; write `result.json`."""
    if settings.evaluate_after and judge and not result.is_interrupted:
        last, episodes = last_of(folder), settings.evaluate_after
        verdict, _ = judge.verdict(last, episodes, settings.device, settings.renderer)
        result = result.with_verdict(verdict.model_dump(mode="json"))
    result.write(folder)
    return Training(folder, result)


def reraise_signal(training: Training, function: str = "train") -> Training:
    """Re-raise the signal that stopped a training run, now that its state is saved.

    `function` of `drone_rl` resumes it.

    Returns `training` if there was no signal, or if the caller's own handler returns. Ctrl-C raises
    a KeyboardInterrupt and no subclass: Python exits by SIGINT, as shells expect, for it alone.
    SIGTERM raises a SystemExit.
    """
    if not training.result.is_interrupted:
        return training
    number = signal.Signals[training.reason]
    handler = signal.getsignal(number)
    if callable(handler) and handler is not signal.default_int_handler:
        signal.raise_signal(number)
        return training
    remedy = f"drone_rl.{function}(folder={str(training.folder)!r}, resume=True)"
    stop = (
        KeyboardInterrupt(f"training stopped, its state is saved; resume with {remedy}")
        if number == signal.SIGINT
        else SystemExit(128 + number)
    )
    vars(stop)["training"] = training
    raise stop


def _own(config: Mapping[str, Any]) -> dict[str, Any]:
    """Return the training settings of a checkpoint."""
    return {k: v for k, v in config.items() if k in TrainSettings.model_fields}


def settings_for(
    settings: TrainSettings | None,
    state: Checkpoint | None,
    changes: Mapping[str, Any],
    function: Callable[..., Any],
) -> TrainSettings:
    """Return a run's settings with changes: those given, of the checkpoint, or the defaults.

    A `Task` among the changes is registered. See `from_arguments` for `function` and errors.
    """
    if settings is None and state is not None:
        settings = settings_of(state.config)
    changes = {name: as_settings(value) for name, value in changes.items()}
    return from_arguments(TrainSettings, settings, changes, function)


def settings_of(config: Mapping[str, Any]) -> TrainSettings:
    """Return a checkpoint's settings; raise an `InputError` if they name an unregistered part."""
    settings = TrainSettings.read(_own(config))
    parts = (settings.network, settings.returns, settings.objective, settings.optimizer)
    for part in (*parts, settings.scheduler, settings.collector, *settings.transforms):
        if not part.is_known:
            raise InputError(
                f"the checkpoint uses {part.target}, which is not registered, and files import "
                "nothing else; pass the settings, too"
            )
    return settings
