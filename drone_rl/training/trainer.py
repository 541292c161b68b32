"""The training loop: collect, estimate, learn, tell."""

import contextlib
import dataclasses
import signal
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from types import FrameType
from typing import Any, Protocol

import torch
from tensordict import TensorDictBase
from torch import Tensor, nn
from torch.nn.utils import clip_grad_norm_

from drone_rl.training.callbacks import Callback
from drone_rl.training.metrics import batch_metrics, episode_rewards, running_mean
from drone_rl.training.restore import check_fits, check_optimiser
from drone_rl.utils.errors import InputError


class Collector(Protocol):
    """What a trainer needs of a collector: whole batches, and a state to resume from."""

    def collect(self) -> TensorDictBase:
        """A batch of complete episodes. Shape: (T_total,)."""
        ...

    def state_dict(self) -> dict:
        """State between two batches."""
        ...

    def load_state_dict(self, state: dict) -> None:
        """Goes on from a state."""
        ...


class NotANumberError(RuntimeError):
    """A loss or gradient was NaN or infinite; the parameters were left as they were."""


@dataclasses.dataclass
class Progress:
    """How far a training is."""

    frames: int = 0
    episodes: int = 0
    updates: int = 0
    seconds: float = 0.0
    """Time spent, over all resumptions."""
    running_cubes: float = 0.0
    """Running mean of the episodes' rewards, from 0, as in the original study."""


class Trainer:
    """REINFORCE on batches of complete episodes, each used once.

    Whatever the batch, one update is one step of the optimiser (Algorithm 4). The state that
    `state_dict` returns between two updates is all there is: training on from it gives, on a CPU,
    the same parameters bit for bit as never having stopped.
    """

    def __init__(
        self,
        *,
        collector: Collector,
        network: nn.Module,
        estimator: nn.Module,
        loss: nn.Module,
        optimiser: torch.optim.Optimizer,
        scheduler: torch.optim.lr_scheduler.LRScheduler | None = None,
        callbacks: Sequence[Callback] = (),
        generators: Mapping[str, torch.Generator] | None = None,
        total_frames: int = 2_000_000,
        total_episodes: int | None = None,
        target: float | None = 2.97,
        running_decay: float = 0.99,
        max_grad_norm: float | None = None,
        minibatch_frames: int = 512,
    ) -> None:
        """Connects the parts.

        Args:
            collector: Yields batches of complete episodes.
            network: The policy's, whose parameters the optimiser holds.
            estimator: Writes the returns into a batch.
            loss: Gives the `loss_*` terms of a batch, as a mean over its steps or a sum.
            optimiser: Over the network's parameters.
            scheduler: Stepped after each update.
            callbacks: Told of every update, in order.
            generators: Random streams to save and restore, by name.
            total_frames: Stop once this many were collected.
            total_episodes: Stop once this many were collected; None for no limit.
            target: Stop once the running mean of cubes reaches it; None for never.
            running_decay: Weight of the old value in the running mean, per episode.
            max_grad_norm: Clip the gradient to this norm; None for no clipping.
            minibatch_frames: Gradients are accumulated over chunks of this size, which bounds
                memory and changes nothing else.
        """
        self.collector = collector
        self.network = network
        self.estimator = estimator
        self.loss = loss
        self.optimiser = optimiser
        self.scheduler = scheduler
        self.callbacks = list(callbacks)
        self.generators = dict(generators or {})
        self.total_frames = total_frames
        self.total_episodes = total_episodes
        self.target = target
        self.running_decay = running_decay
        self.max_grad_norm = max_grad_norm
        self.minibatch_frames = minibatch_frames
        self.progress = Progress()
        self.stop_signal: signal.Signals | None = None
        self.stop_request = ""
        """Why a callback wants training to stop after this update; empty to go on."""

    def run(self) -> str:
        """Trains until solved, out of budget or told to stop.

        Ctrl-C and SIGTERM let the current update finish, so that nothing is lost; a second Ctrl-C
        aborts at once.

        Returns:
            Why it stopped: "solved", "frames", "episodes", a signal's name or what a callback
            gave as `stop_request`.

        Raises:
            NotANumberError: A loss or gradient was NaN or infinite.
        """
        with self._signals():
            self._tell("on_start")
            try:
                while not (reason := self._stop_reason()):
                    self._tell("on_update", self._update())
            except NotANumberError:
                self._tell("on_failure")
                raise
            self._tell("on_end", reason)
        return reason

    def _update(self) -> dict[str, float]:
        begin = time.perf_counter()
        batch = self.collector.collect()
        collected = time.perf_counter()
        terms = self._learn(self.estimator(batch))
        end = time.perf_counter()
        done, progress = episode_rewards(batch), self.progress
        progress.frames += len(batch)
        progress.episodes += len(done)
        progress.updates += 1
        progress.seconds += end - begin
        progress.running_cubes = running_mean(progress.running_cubes, done, self.running_decay)
        return {
            "train/running_cubes": progress.running_cubes,
            **batch_metrics(batch),
            **terms,
            "train/learning_rate": self.optimiser.param_groups[0]["lr"],
            "time/frames_per_second": len(batch) / (end - begin),
            "time/collect_s": collected - begin,
            "time/learn_s": end - collected,
        }

    def _learn(self, batch: TensorDictBase) -> dict[str, float]:
        """One step of the optimiser. Returns the loss terms and the gradient's norm."""
        self.optimiser.zero_grad()
        totals: dict[str, float] = {}
        for chunk in batch.split(self.minibatch_frames):
            share = self._share(chunk, batch)
            losses = self.loss(chunk)
            terms = {k: v for k, v in losses.items() if k.startswith("loss_")}
            for name, value in terms.items():
                self._check(value, f"{name}")
            (sum(terms.values()) * share).backward()
            for name, value in losses.items():
                weight = share if name in terms else len(chunk) / len(batch)
                totals[f"loss/{name}"] = (
                    totals.get(f"loss/{name}", 0.0) + float(value.detach()) * weight
                )
        for name, parameter in self.network.named_parameters():
            if parameter.grad is not None:
                self._check(parameter.grad, f"the gradient of {name}")
        bound = float("inf") if self.max_grad_norm is None else self.max_grad_norm
        norm = clip_grad_norm_(self.network.parameters(), bound)
        self.optimiser.step()
        if self.scheduler is not None:
            self.scheduler.step()
        return {**totals, "loss/grad_norm": float(norm)}

    def _share(self, chunk: TensorDictBase, batch: TensorDictBase) -> float:
        """Weight of a chunk's loss, so that the chunks add up to the batch's."""
        reduction = getattr(self.loss, "reduction", "mean")
        return 1.0 if reduction == "sum" else len(chunk) / len(batch)

    def _check(self, value: Tensor, what: str) -> None:
        if not bool(torch.isfinite(value).all()):
            self.optimiser.zero_grad()
            raise NotANumberError(
                f"{what} is NaN or infinite at update {self.progress.updates + 1}; the parameters "
                "are those before it; lower optimiser.lr or set trainer.max_grad_norm"
            )

    def _stop_reason(self) -> str:
        progress = self.progress
        if self.stop_signal is not None:
            return self.stop_signal.name
        if self.stop_request:
            return self.stop_request
        if self.target is not None and progress.running_cubes >= self.target:
            return "solved"
        if self.total_episodes is not None and progress.episodes >= self.total_episodes:
            return "episodes"
        return "frames" if progress.frames >= self.total_frames else ""

    def _tell(self, hook: str, *args: object) -> None:
        for callback in self.callbacks:
            getattr(callback, hook)(self, *args)

    @contextlib.contextmanager
    def _signals(self) -> Iterator[None]:
        """Notes the first Ctrl-C or SIGTERM; gives the handlers back at the first and the end."""
        if threading.current_thread() is not threading.main_thread():
            yield
            return
        watched = (signal.SIGINT, signal.SIGTERM)
        before = {number: signal.getsignal(number) for number in watched}

        def restore() -> None:
            for number, handler in before.items():
                signal.signal(number, handler)

        def note(number: int, frame: FrameType | None) -> None:
            del frame
            self.stop_signal = signal.Signals(number)
            restore()

        for number in watched:
            signal.signal(number, note)
        try:
            yield
        finally:
            restore()

    def state_dict(self) -> dict[str, Any]:
        """Everything that the next update depends on."""
        return {
            "policy": self.network.state_dict(),
            "estimator": self.estimator.state_dict(),
            "optimiser": self.optimiser.state_dict(),
            "scheduler": None if self.scheduler is None else self.scheduler.state_dict(),
            "collector": self.collector.state_dict(),
            "generators": {k: g.get_state() for k, g in self.generators.items()},
            "torch_rng": torch.get_rng_state(),
            "progress": dataclasses.asdict(self.progress),
        }

    def load_state_dict(self, state: Mapping[str, Any]) -> None:
        """Goes on from a `state_dict`, be it out of a file that nobody should trust.

        Raises:
            InputError: It is not one of such a training.
        """
        own = self.state_dict()
        for key in own:
            if key not in state:
                raise InputError(f"the checkpoint has no {key}, so no training can go on from it")
            if key != "optimiser":
                check_fits(state[key], own[key], key)
        check_optimiser(state["optimiser"], self.optimiser)
        try:
            self._take_over(state)
        except (RuntimeError, ValueError, TypeError, LookupError, OverflowError) as error:
            reason = str(error).splitlines()[0] if str(error) else type(error).__name__
            raise InputError(
                f"the checkpoint does not fit this training ({reason}); go on from one of a run "
                "with these settings, or start a new run"
            ) from None

    def _take_over(self, state: Mapping[str, Any]) -> None:
        self.network.load_state_dict(state["policy"])
        self.estimator.load_state_dict(state["estimator"])
        self.optimiser.load_state_dict(state["optimiser"])
        if self.scheduler is not None:
            self.scheduler.load_state_dict(state["scheduler"])
        self.collector.load_state_dict(state["collector"])
        for name, generator in self.generators.items():
            generator.set_state(state["generators"][name])
        torch.set_rng_state(state["torch_rng"])
        self.progress = Progress(**state["progress"])
