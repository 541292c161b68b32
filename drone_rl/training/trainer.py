"""The parts around a training loop: batches, stop rules, counts, metrics, signals, callbacks."""

import contextlib
import dataclasses
import enum
import signal
import time
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping, Sequence
from typing import Any

import torch
from tensordict import TensorDictBase

from drone_rl.objectives import ReturnEstimator
from drone_rl.training.callbacks import Callback, TrainingProgress
from drone_rl.training.learners import Learner, NotANumberError, check_batch
from drone_rl.training.metrics import (
    batch_metrics,
    check_rewards,
    episode_rewards,
    running_mean,
)
from drone_rl.training.restore import check_fits
from drone_rl.training.signals import noted_signals
from drone_rl.utils.errors import InputError
from drone_rl.utils.memory import return_freed_memory
from drone_rl.utils.plugins import place_of
from drone_rl.utils.seeding import as_global_stream

TRIM_INTERVAL = 16
"""Updates between releases of freed memory; a release makes the next update 10% slower."""


@dataclasses.dataclass(kw_only=True, eq=False, repr=False)
class Trainer:
    """Provide batches until the task is solved or the budget spent; count, log and save.

        with trainer.running() as batches:
            for batch in batches:
                trainer.finish_update(batch, learner.update(batch))

    `state_dict` returns the full state between two updates. On a CPU, a run that resumes from it
    ends with the same parameters, bit for bit, as one that never stopped.
    """

    collector: Any
    """Iterates over batches, as TorchRL's collectors do; has `state_dict` and `load_state_dict`.
    The caller shuts it down."""
    learner: Learner
    """Learns from the batches in the caller's loop; its state is saved and restored here."""
    callbacks: Sequence[Callback] = dataclasses.field(default_factory=list)
    """Called after every update, in order."""
    generators: Mapping[str, torch.Generator] = dataclasses.field(default_factory=dict)
    """Random streams to save and restore, by name."""
    stream: torch.Generator | None = None
    """Stream of code that draws from torch's global one, such as dropout; it is the global one in
    each iteration, and other threads that need theirs wait. None if there is no such code."""
    total_frames: int = 2_000_000
    """Stop once this many frames were collected."""
    total_episodes: int | None = None
    """Stop once this many episodes were collected; None for no limit."""
    target: float | None = 2.97
    """Stop once the running mean of the episodes' rewards reaches it; None for never."""
    confirm: Callable[[int], bool] | None = None
    """Called with the number of updates when the target is reached; returns whether the policy has
    solved its task. By default the target is enough."""
    confirm_interval: int | None = None
    """Updates between two calls of `confirm`; None for one at each update that reaches the target,
    and for no calls without a target."""
    running_decay: float = 0.99
    """Weight of the old value in the running mean, per episode."""
    ends: Iterable[enum.IntEnum] = ()
    """Why an episode may end (`Task.ends`), for the metrics."""
    reward_terms: Sequence[str] = ()
    """Names of the reward's terms (`Task.reward_terms`), for the metrics."""
    progress: TrainingProgress = dataclasses.field(default_factory=TrainingProgress, init=False)
    stop_signal: signal.Signals | None = dataclasses.field(default=None, init=False)
    stop_request: str = dataclasses.field(default="", init=False)
    """Why a callback wants training to stop after this update; empty to go on."""
    _reason: str = dataclasses.field(default="", init=False)
    _begin: float = dataclasses.field(default=0.0, init=False)
    _collected: float = dataclasses.field(default=0.0, init=False)
    """Times at which the current batch was requested and received, in seconds."""

    @property
    def reason(self) -> str:
        """Why it stopped: "solved", "frames", "episodes", a signal or a callback's `stop_request`.

        "frames" is also the reason if the collector has no more batches. A signal takes precedence,
        also if it arrives at the end: the caller must raise it again.
        """
        return self._reason if self.stop_signal is None else self.stop_signal.name

    @contextlib.contextmanager
    def running(self) -> Iterator[Iterator[TensorDictBase]]:
        """Provide the batches of a training run; pass each with its metrics to `finish_update`.

        The batches end when the task is solved, the budget is spent or a signal arrives. Ctrl-C and
        SIGTERM let the current update finish, so that nothing is lost; a second Ctrl-C, or a
        SIGTERM more than a second later, acts at once. Signals are watched in the main thread only.

        Raises:
            NotANumberError: A loss or gradient was NaN or infinite.
            InputError: A batch lacks an entry that the learner reads.
        """
        with noted_signals(self._note):
            self._notify("on_start")
            try:
                with contextlib.closing(self._batches()) as batches:
                    yield batches
            except NotANumberError as error:
                self._notify("on_failure")
                raise NotANumberError(
                    f"{error} at update {self.progress.updates + 1}; the parameters are those "
                    "before it; lower optimizer.lr or set trainer.max_grad_norm"
                ) from None
            self._notify("on_end", self._reason)

    def _batches(self) -> Generator[TensorDictBase]:
        batches = iter(self.collector)
        while True:
            with as_global_stream(self.stream):
                if reason := self._stop_reason():
                    break
                self._begin = time.perf_counter()
                batch = next(batches, None)
                if batch is None:
                    reason = "frames"
                    break
                self._collected = time.perf_counter()
                check_batch(batch, self.learner.in_keys, type(self.learner).__name__)
                check_rewards(batch)
                yield batch
            if self.progress.updates % TRIM_INTERVAL == 0:
                return_freed_memory()
        self._reason = reason

    def finish_update(self, batch: TensorDictBase, metrics: Mapping[str, float]) -> None:
        """Count a batch that the learner has learned from, and call the callbacks.

        Args:
            batch: The batch.
            metrics: What the learner's `update` returned; an `InputError` unless numbers by name.
        """
        end = time.perf_counter()
        try:
            metrics = {name: float(value) for name, value in metrics.items()}
        except (AttributeError, TypeError, ValueError, RuntimeError):
            raise InputError(
                f"update of {place_of(type(self.learner))} returns {metrics!r:.80}; return numbers "
                'by name, as in {"loss/mine": 0.5}'
            ) from None
        rewards, progress = episode_rewards(batch), self.progress
        progress.frames += batch.numel()
        progress.episodes += len(rewards)
        progress.updates += 1
        progress.seconds += end - self._begin
        progress.running_reward = running_mean(progress.running_reward, rewards, self.running_decay)
        logged = {
            "train/running_reward": progress.running_reward,
            **batch_metrics(batch, self.ends, self.reward_terms),
            **metrics,
            "time/frames_per_second": batch.numel() / (end - self._begin),
            "time/collect_s": self._collected - self._begin,
            "time/learn_s": end - self._collected,
        }
        if self.stream is not None:
            self.stream.set_state(torch.get_rng_state())
        self._notify("on_update", logged)

    @property
    def _estimator(self) -> ReturnEstimator | None:
        """The collector's return estimator, if it has one: its state is part of the run's."""
        postproc = getattr(self.collector, "postproc", None)
        return postproc if isinstance(postproc, ReturnEstimator) else None

    def _stop_reason(self) -> str:
        progress = self.progress
        if self.stop_signal is not None:
            return self.stop_signal.name
        if self.stop_request:
            return self.stop_request
        is_solved = self._is_solved()
        if self.stop_signal is not None:  # it came during the confirmation, which a resume repeats
            return self.stop_signal.name
        if is_solved:
            return "solved"
        if self.total_episodes is not None and progress.episodes >= self.total_episodes:
            return "episodes"
        return "frames" if progress.frames >= self.total_frames else ""

    def _is_solved(self) -> bool:
        progress, interval = self.progress, self.confirm_interval
        if self.target is None:
            is_due = interval is not None
        else:
            is_due = progress.running_reward >= self.target
        if not is_due or not progress.updates or progress.updates % (interval or 1):
            return False
        begin = time.perf_counter()
        is_confirmed = self.confirm is None or self.confirm(progress.updates)
        progress.seconds += time.perf_counter() - begin
        return is_confirmed

    def _note(self, number: int) -> None:
        self.stop_signal = signal.Signals(number)

    def _notify(self, hook: str, *args: object) -> None:
        for callback in self.callbacks:
            getattr(callback, hook)(self, *args)

    def state_dict(self) -> dict[str, Any]:
        """Return everything that the next update depends on."""
        estimator = self._estimator
        return {
            **self.learner.state_dict(),
            **({} if estimator is None else {"estimator": estimator.state_dict()}),
            "collector": self.collector.state_dict(),
            "generators": {k: g.get_state() for k, g in self.generators.items()},
            "torch_rng": (self.stream or torch.default_generator).get_state(),
            "progress": dataclasses.asdict(self.progress),
        }

    def load_state_dict(self, state: Mapping[str, Any]) -> None:
        """Resume from a `state_dict`, which may come from an untrusted file.

        Raises:
            InputError: It is not the state of such a training run.
        """
        current = self.state_dict()
        for key in current:
            if key not in state:
                raise InputError(f"the checkpoint has no {key}, so no run can resume from it")
        self.learner.check_state(state)
        for key in ("collector", "estimator", "generators", "torch_rng", "progress"):
            if key in current:
                check_fits(state[key], current[key], key)
        try:
            self.learner.load_state_dict(state)
            self.collector.load_state_dict(state["collector"])
            if self._estimator is not None:
                self._estimator.load_state_dict(state["estimator"])
            streams = {**self.generators, **({"": self.stream} if self.stream else {})}
            states = {**state["generators"], "": state["torch_rng"]}
            for name, generator in streams.items():
                generator.set_state(states[name])
            self.progress = TrainingProgress(**state["progress"])
        except (RuntimeError, ValueError, TypeError, LookupError, OverflowError) as error:
            reason = str(error).splitlines()[0] if str(error) else type(error).__name__
            raise InputError(
                f"the checkpoint does not fit this run ({reason}); resume from that of a run "
                "with these settings, or start a new run"
            ) from None
