"""Learners: what a trainer expects of them, and REINFORCE."""

import dataclasses
import threading
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, Protocol

import torch
from tensordict import TensorDictBase
from tensordict.utils import NestedKey
from torch import Tensor, nn
from torch.nn.utils import clip_grads_with_norm_, get_total_norm

from drone_rl.config.training import TrainerSettings
from drone_rl.objectives import ReinforceLoss
from drone_rl.training.restore import check_fits, check_optimizer
from drone_rl.utils.errors import InputError

_MODES = threading.Lock()
"""TorchRL's loss modules set modes of the whole process, and restore them afterwards."""


class NotANumberError(RuntimeError):
    """A loss or gradient was NaN or infinite; the parameters were left as they were."""


class Learner(Protocol):
    """One update from one batch.

    A learner holds networks, losses and optimizers, and decides how often to pass over a batch and
    in which minibatches. A batch is what the collector yields: complete episodes one after the
    other, shape (T_total,), or rows of fixed length, shape (num_envs, T).
    """

    @property
    def in_keys(self) -> Sequence[NestedKey]:
        """Entries that a batch must have."""
        ...

    def update(self, batch: TensorDictBase) -> dict[str, float]:
        """Learn from a batch.

        Returns:
            Metrics by name, the same names at every update.

        Raises:
            NotANumberError: The parameters would become NaN or infinite; they are unchanged.
            InputError: The batch lacks something.
        """
        ...

    def state_dict(self) -> dict[str, Any]:
        """Return all that the next update depends on; "policy" is the policy's `state_dict`."""
        ...

    def check_state(self, state: Mapping[str, Any]) -> None:
        """Check a state before any of it is loaded.

        Args:
            state: Has the keys of `state_dict`; its values are not trusted.

        Raises:
            InputError: It is not a state of this learner; the first difference is named.
        """
        ...

    def load_state_dict(self, state: Mapping[str, Any]) -> None:
        """Resume from a state."""
        ...


@dataclasses.dataclass(kw_only=True, eq=False, repr=False)
class GradientLearner:
    """Base of learners with one optimizer: their state, and the step of the scheduler."""

    network: nn.Module
    """Network of the policy; its weights are saved as "policy"."""
    optimizer: torch.optim.Optimizer
    """Over the parameters that learn."""
    scheduler: torch.optim.lr_scheduler.LRScheduler | None = None
    """Stepped after each update."""
    max_grad_norm: float | None = None
    """Clip the gradient to this norm; None for no clipping."""
    num_threads: int | None = None
    """PyTorch's threads while it learns; None for those of the trainer's settings."""

    def _step_scheduler(self) -> float:
        """Step the scheduler; return the learning rate of the next update."""
        if self.scheduler is not None:
            self.scheduler.step()
        return self.optimizer.param_groups[0]["lr"]

    def state_dict(self) -> dict[str, Any]:
        """Return the weights and the states of optimizer and scheduler."""
        return {
            "policy": self.network.state_dict(),
            "optimizer": self.optimizer.state_dict(),
            "scheduler": None if self.scheduler is None else self.scheduler.state_dict(),
        }

    def check_state(self, state: Mapping[str, Any]) -> None:
        """See `Learner.check_state`."""
        for key, value in self.state_dict().items():
            if key != "optimizer":
                check_fits(state[key], value, key)
        check_optimizer(state["optimizer"], self.optimizer)

    def load_state_dict(self, state: Mapping[str, Any]) -> None:
        """Resume from a state."""
        self.network.load_state_dict(state["policy"])
        self.optimizer.load_state_dict(state["optimizer"])
        if self.scheduler is not None:
            self.scheduler.load_state_dict(state["scheduler"])


@dataclasses.dataclass(kw_only=True, eq=False, repr=False)
class ReinforceLearner(GradientLearner):
    """REINFORCE (Algorithm 4): one optimizer step for each batch of episodes with returns."""

    loss: ReinforceLoss
    """Gives the `loss_*` terms of a batch, reduced over its steps."""
    chunk_frames: int = TrainerSettings().chunk_frames
    """Frames per forward and backward pass. Gradients are accumulated over chunks, so this bounds
    memory and affects only rounding."""
    whole_episodes: bool = False
    """Whether chunks consist of whole episodes, as a recurrent network needs them."""

    @property
    def in_keys(self) -> Sequence[NestedKey]:
        """See `Learner`."""
        return self.loss.in_keys

    def update(self, batch: TensorDictBase) -> dict[str, float]:
        """Take one optimizer step.

        Args:
            batch: With returns, see `ReturnEstimator`. Shape: (T_total,) or (num_envs, T); steps
                outside ("collector", "mask"), whose return is unknown, are left out.

        Returns:
            The terms of the loss, the gradient's norm and the learning rate of the next step.

        Raises:
            NotANumberError: A loss or gradient is NaN or infinite.
        """
        mask = batch.get(("collector", "mask"), None)
        steps: Any = batch.reshape(-1) if mask is None else batch[mask]
        chunks: int | list[int] = self.chunk_frames
        if self.whole_episodes:
            chunks = episode_chunks(steps.get(("next", "done"))[:, 0], self.chunk_frames)
        self.optimizer.zero_grad()
        try:
            terms = add_gradients(steps, self.loss, chunks, self.loss.divisor)
            norm = descend(self.optimizer, self.network.named_parameters(), self.max_grad_norm)
        except NotANumberError:
            self.optimizer.zero_grad()
            raise
        losses = {f"loss/{name}": value for name, value in {**terms, "grad_norm": norm}.items()}
        return {**losses, "train/learning_rate": self._step_scheduler()}


def check_batch(batch: TensorDictBase, keys: Sequence[NestedKey], reader: str) -> None:
    """Raise an `InputError` if a batch lacks one of the entries that `reader` learns from."""
    held = batch.keys(include_nested=True)
    for key in keys:
        if key not in held:
            is_return = key == "return_to_go"
            remedy = (
                "give the collector a return estimator, as in postproc=RewardToGo()"
                if is_return
                else "use a collector that keeps it, such as collector=rollouts"
            )
            raise InputError(f"a batch has no entry {key!r}, which {reader} learns from; {remedy}")


def check_finite(value: Tensor, name: str) -> None:
    """Raise `NotANumberError` if a loss or gradient is NaN or infinite."""
    if not bool(torch.isfinite(value).all()):
        raise NotANumberError(f"{name} is NaN or infinite")


def episode_chunks(done: Tensor, chunk_frames: int) -> list[int]:
    """Return the sizes of chunks of whole episodes.

    Args:
        done: Whether a step is its episode's last. Shape: (num_steps,).
        chunk_frames: Steps in a chunk at most, unless a single episode has more.
    """
    ends = {*(done.nonzero()[:, 0] + 1).tolist(), len(done)}
    sizes, begin, end = [], 0, 0
    for following in sorted(ends):
        if following - begin > chunk_frames and end > begin:
            sizes.append(end - begin)
            begin = end
        end = following
    return [*sizes, end - begin]


def add_gradients(
    batch: TensorDictBase,
    losses: Callable[[TensorDictBase], TensorDictBase],
    chunks: int | list[int],
    divisor: Callable[[TensorDictBase], int] = len,
) -> dict[str, float]:
    """Add the gradient of steps (num_steps,) to the parameters, chunk by chunk.

    Args:
        batch: The steps.
        losses: Returns the terms of the loss, `loss_*`, and other metrics.
        chunks: Steps in one forward and backward pass, or in each of them; bounds memory and
            affects rounding.
        divisor: What the terms of steps are divided by; by default they are means over steps.

    Returns:
        Terms and metrics of the whole batch, by name.

    Raises:
        NotANumberError: A term is NaN or infinite.
    """
    totals: dict[str, float] = {}
    for chunk in batch.split(chunks):
        share = len(chunk) / len(batch)
        weight = divisor(chunk) / divisor(batch)
        with _MODES:
            metrics = losses(chunk)
        terms = {k: v for k, v in metrics.items() if k.startswith("loss_")}
        for name, value in terms.items():
            check_finite(value, name)
        total: Any = sum(terms.values())  # its type includes the int 0 of an empty sum
        (total * weight).backward()
        for name, value in metrics.items():
            part = float(value.detach()) * (weight if name in terms else share)
            totals[name] = totals.get(name, 0.0) + part
    return totals


def descend(
    optimizer: torch.optim.Optimizer,
    parameters: Iterable[tuple[str, nn.Parameter]],
    max_norm: float | None,
) -> float:
    """Step the optimizer; return the gradient's norm before it was clipped to `max_norm`.

    Raises:
        NotANumberError: The gradient is NaN or infinite; no parameter was changed.
    """
    weights = {name: p for name, p in parameters if p.grad is not None}
    gradients = {name: p.grad for name, p in weights.items() if p.grad is not None}
    norm = get_total_norm(gradients.values())
    if not bool(torch.isfinite(norm)):  # or finite numbers whose squares are not
        for name, gradient in gradients.items():
            check_finite(gradient, f"the gradient of {name}")
    if max_norm is not None:
        clip_grads_with_norm_(weights.values(), max_norm, norm)
    optimizer.step()
    return float(norm)
