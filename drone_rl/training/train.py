"""One training from its settings to its result."""

import dataclasses
import enum
import json
import signal
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import torch
import yaml

from drone_rl.config.configuration import as_config, check_same_config, from_config
from drone_rl.config.training import TrainSettings
from drone_rl.policies.policy import Policy, load_policy
from drone_rl.policies.zoo import describe, read_checkpoint
from drone_rl.sim.tasks import FailureReplayTask, as_task
from drone_rl.training import Callback, CheckpointCallback, CsvCallback, NotANumberError, Trainer
from drone_rl.training.build_collector import build_collector
from drone_rl.training.build_learner import build_learner
from drone_rl.training.confirmation import Confirmation
from drone_rl.training.progress import OngoingTraining
from drone_rl.utils.display import picture, table
from drone_rl.utils.errors import InputError
from drone_rl.utils.files import folder_lock, remove_leftovers, write_atomically
from drone_rl.utils.memory import bound_kernels
from drone_rl.utils.progress import Bar, Progress
from drone_rl.utils.provenance import provenance
from drone_rl.utils.readers import read_table
from drone_rl.utils.schema import Real
from drone_rl.utils.settings import kinds_of

MAY_CHANGE = (
    "trainer.total_frames",
    "trainer.total_episodes",
    "trainer.target_share",
    "trainer.confirm_episodes",
    "trainer.confirm_share",
    "trainer.checkpoint_interval_s",
    "evaluate_after",
    "renderer",
)
"""Settings that a resumed run may change: they don't enter into what is learned."""
_WRITTEN = ("metrics.csv", "result.json", "run.yaml", "provable.json")
"""Files in a run's folder that are replaced when they are whole."""
_NONE_YET = float("-inf")
"""The best running mean before the first update."""


@dataclasses.dataclass(frozen=True)
class Training:
    """What a training left, in its folder."""

    folder: Path
    reason: str
    """Why it stopped: "solved", "frames", "episodes" or a signal's name."""
    result: dict[str, Any]
    """Plain values, as in `result.json`."""

    @property
    def running_reward(self) -> float:
        """Running mean of the episodes' rewards at the end."""
        return self.result["running_reward"]

    @property
    def policy(self) -> Policy:
        """The last policy."""
        return load_policy(self.folder)

    def metrics(self) -> dict[str, list[float]]:
        """Each column of `metrics.csv`, one value an update."""
        head, *rows = read_table(self.folder / "metrics.csv")
        columns = zip(head, zip(*rows, strict=True), strict=True)
        return {name: [float(value) for value in column] for name, column in columns}

    def _repr_html_(self) -> str:
        from matplotlib.figure import Figure  # slow to import; only a notebook needs it

        columns = self.metrics()
        figure = Figure(figsize=(6, 3), layout="constrained")
        axes = figure.add_subplot(xlabel="frames", ylabel="running mean of rewards")
        axes.plot(columns["frames"], columns["train/running_reward"])
        values = {k: v for k, v in self.result.items() if not isinstance(v, dict)}
        rows = [[k, f"{v:.4g}" if isinstance(v, float) else str(v)] for k, v in values.items()]
        return table(["training", str(self.folder)], rows) + picture(figure)


def train(
    settings: TrainSettings | None = None,
    *,
    folder: str | Path | None = None,
    resume: bool = False,
    callbacks: Sequence[Callback] = (),
    progress: Progress | None = None,
    **changes: Any,
) -> Training:
    """Trains one policy, or goes on with it.

    Ctrl-C and SIGTERM let the current update finish; its state is saved before they act. In other
    threads than the main one they are not watched.

    Args:
        settings: What is learned, how, and for how long; those of the run if it is resumed.
        folder: Where everything is left; by default a new one under outputs/train/runs.
        resume: Whether to go on with the run that is in the folder, bit for bit.
        callbacks: Told of every update, besides those that write checkpoints and metrics.
        progress: Told of how far it is; a bar by default.
        changes: Settings to change, as in `train(seed=1, task=TaskSettings(num_cubes=5))`.

    Raises:
        InputError: A setting is unusable, or learning broke down.
        KeyboardInterrupt: Ctrl-C stopped it; its attribute `training` is the result so far.
        SystemExit: SIGTERM stopped it (status 143); likewise. If the caller has a handler of its
            own for the signal, that handler is called instead; if it returns, so does this.
    """
    folder = new_folder() if folder is None else Path(folder)
    state = read_checkpoint(last_of(folder)) if resume else None
    if settings is None:
        settings = TrainSettings() if state is None else settings_of(state["config"])
    settings = settings.replace(**changes)
    folder.mkdir(parents=True, exist_ok=True)
    with folder_lock(folder):
        told = [*callbacks, Tell(progress or Bar())]
        done = finish(settings, folder, learn(settings, folder, state, told))
    return hand_on_signal(done)


def hand_on_signal(training: Training) -> Training:
    """Lets a signal that stopped a training act, now that its state is saved.

    Args:
        training: Its result, which is returned if no signal stopped it, or if the caller's own
            handler of that signal returns.

    Raises:
        KeyboardInterrupt: Ctrl-C stopped it. Not a subclass: Python ends itself by SIGINT, which
            shells want to see, only for this very class.
        SystemExit: SIGTERM stopped it.
    """
    if not training.reason.startswith("SIG"):
        return training
    number = signal.Signals[training.reason]
    handler = signal.getsignal(number)
    if callable(handler) and handler is not signal.default_int_handler:
        signal.raise_signal(number)
        return training
    remedy = f"drone_rl.train(folder={str(training.folder)!r}, resume=True)"
    stop = (
        KeyboardInterrupt(f"training stopped, its state is saved; go on with {remedy}")
        if number == signal.SIGINT
        else SystemExit(128 + number)
    )
    vars(stop)["training"] = training
    raise stop


def learn(
    settings: TrainSettings,
    folder: Path,
    state: Mapping[str, Any] | None,
    callbacks: Sequence[Callback],
    practice: FailureReplayTask | None = None,
) -> dict[str, Any]:
    """Trains until solved, out of budget or told to stop, and leaves checkpoints and metrics.

    Args:
        settings: What is learned, how, and for how long.
        folder: Where everything is left; this process holds it.
        state: Of the checkpoint to go on from, if any.
        callbacks: Told of every update, besides those that write checkpoints and metrics.
        practice: Where episodes begin, if not anywhere; not a part of what is saved.

    Returns:
        Why it stopped and how far it came, as in `result.json`.

    Raises:
        InputError: The checkpoint is of another training, or learning broke down.
    """
    if state is not None:
        check_same_config(_own(state["config"]), as_config(settings), MAY_CHANGE)
    remove_leftovers(folder, *_WRITTEN)
    trainer, checkpoints, confirmation = _build(settings, folder, callbacks, practice)
    try:
        if state is not None:
            trainer.load_state_dict(state)
            checkpoints.best = _read_best(state.get("best"))
        _note(folder, checkpoints.extra)
        reason = trainer.run()
    except NotANumberError as error:
        raise InputError(f"{error}; the last good checkpoint is {checkpoints.last_path}") from error
    finally:
        trainer.collector.shutdown()
        if confirmation is not None:
            confirmation.close()
    progress = dataclasses.asdict(trainer.progress)
    largest = as_task(settings.task).largest_reward
    told = {} if confirmation is None else confirmation.told
    return {"reason": reason, **progress, "largest_reward": largest, **told}


def finish(settings: TrainSettings, folder: Path, result: dict[str, Any]) -> Training:
    """Judges the last policy, if that is asked for and no signal ended it, and notes the result.

    Args:
        settings: Of the training.
        folder: Its own.
        result: Goes into `result.json`.
    """
    if settings.evaluate_after and not result["reason"].startswith("SIG"):
        from drone_rl.evaluation.judge import judge_for_selection  # slow to import, and few need it

        last, episodes = last_of(folder), settings.evaluate_after
        given = (settings.device, settings.renderer)
        result["verdict"], _ = judge_for_selection(last, episodes, *given)
    write_atomically(folder / "result.json", json.dumps(result, indent=2))
    return Training(folder, result["reason"], result)


def _build(
    settings: TrainSettings,
    folder: Path,
    callbacks: Sequence[Callback],
    practice: FailureReplayTask | None,
) -> tuple[Trainer, CheckpointCallback, Confirmation | None]:
    config, origin = as_config(settings), provenance()
    description = describe(settings).as_dict()
    # sums depend on how many threads make them: on as many everywhere, whatever the machine has
    torch.set_num_threads(settings.trainer.num_threads)
    bound_kernels()
    made = build_collector(settings, practice)
    limits = settings.trainer
    checkpoints = CheckpointCallback(
        folder / "checkpoints",
        interval_s=limits.checkpoint_interval_s,
        extra={"config": config, "description": description, "provenance": origin},
    )
    share = limits.target_share
    confirmation = Confirmation(settings, made.network) if limits.confirm_episodes else None
    trainer = Trainer(
        collector=made.collector,
        learner=build_learner(settings, made),
        callbacks=[CsvCallback(folder / "metrics.csv"), checkpoints, *callbacks],
        generators=made.generators,
        target=None if share is None else share * as_task(settings.task).largest_reward,
        confirm=confirmation,
        total_frames=limits.total_frames,
        total_episodes=limits.total_episodes,
        running_decay=limits.running_decay,
        ends=_ends(settings),
    )
    return trainer, checkpoints, confirmation


def _note(folder: Path, extra: Mapping[str, Any]) -> None:
    """Writes `run.yaml`: the settings, what they describe, versions and machine."""
    noted = {"config": extra["config"], "description": extra["description"], **extra["provenance"]}
    write_atomically(folder / "run.yaml", yaml.safe_dump(noted, sort_keys=False))


def _ends(settings: TrainSettings) -> list[enum.IntEnum]:
    """Why its episodes may end; nothing gets out of control in computer-vision mode."""
    is_calm = settings.dynamics.is_computer_vision
    ends = as_task(settings.task).ends
    return [end for end in ends if not (is_calm and end.name == "LOST_CONTROL")]


class Tell(Callback):
    """Passes on how far a training is."""

    def __init__(self, progress: Progress) -> None:
        """Takes whom to tell."""
        self.progress = progress

    def on_update(self, training: OngoingTraining, metrics: Mapping[str, float]) -> None:
        """Tells the running mean and the frames."""
        done = training.progress
        text = f"running reward {done.running_reward:.2f}, {done.episodes} episodes"
        self.progress(text, done.frames, training.total_frames)

    def on_end(self, training: OngoingTraining, reason: str) -> None:
        """Tells that it is over, and why."""
        frames = training.progress.frames
        self.progress(f"stopped: {reason}", frames, frames)


def _own(config: Mapping[str, Any]) -> dict[str, Any]:
    """What a checkpoint's configuration says of the training itself, in today's words."""
    return {k: v for k, v in config.items() if k in kinds_of(TrainSettings)}


def settings_of(config: Mapping[str, Any]) -> TrainSettings:
    """The settings that a checkpoint was made with; only such as name parts of our own.

    Raises:
        InputError: It names another part, which a file may not.
    """
    settings = from_config(TrainSettings, _own(config))
    parts = (settings.network, settings.returns, settings.objective, settings.optimiser)
    for part in (*parts, settings.scheduler, settings.collector, *settings.transforms):
        if not part.is_known:
            raise InputError(
                f"the checkpoint names {part.target}, which a file may not; give the settings, too"
            )
    return settings


def _read_best(value: Any) -> float:
    """The best running mean out of a checkpoint.

    Raises:
        InputError: It is no number.
    """
    if type(value) is float and value == _NONE_YET:
        return value
    return Real(-1e6, 1e6).read(value, "the checkpoint's best")


def last_of(folder: Path) -> Path:
    """The newest checkpoint of a run."""
    return folder / "checkpoints" / "last.pt"


def new_folder() -> Path:
    """Named by when it begins, like those of `drone-rl train`."""
    now = time.time()
    stamp = time.strftime("%Y-%m-%d_%H-%M-%S", time.localtime(now))
    return Path("outputs/train/runs") / f"{stamp}-{int(now % 1 * 1e6):06d}"
