"""Learners: what a trainer expects of them, and what those with an optimizer share."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, Protocol

import torch
from tensordict import TensorDictBase
from tensordict.utils import NestedKey
from torch import Tensor, nn
from torch.nn.utils import clip_grads_with_norm_, get_total_norm

from drone_rl.training.restore import check_fits, check_optimiser
from drone_rl.utils.errors import InputError


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


class GradientLearner:
    """Base of learners with one optimizer: their state, and the step of the scheduler."""

    network: nn.Module
    optimiser: torch.optim.Optimizer
    scheduler: torch.optim.lr_scheduler.LRScheduler | None

    def _next_rate(self) -> float:
        """Step the scheduler. Returns the learning rate of the next update."""
        if self.scheduler is not None:
            self.scheduler.step()
        return self.optimiser.param_groups[0]["lr"]

    def state_dict(self) -> dict[str, Any]:
        """Return the weights and the states of optimizer and scheduler."""
        return {
            "policy": self.network.state_dict(),
            "optimiser": self.optimiser.state_dict(),
            "scheduler": None if self.scheduler is None else self.scheduler.state_dict(),
        }

    def check_state(self, state: Mapping[str, Any]) -> None:
        """See `Learner.check_state`."""
        for key, value in self.state_dict().items():
            if key != "optimiser":
                check_fits(state[key], value, key)
        check_optimiser(state["optimiser"], self.optimiser)

    def load_state_dict(self, state: Mapping[str, Any]) -> None:
        """Resume from a state."""
        self.network.load_state_dict(state["policy"])
        self.optimiser.load_state_dict(state["optimiser"])
        if self.scheduler is not None:
            self.scheduler.load_state_dict(state["scheduler"])


def check_batch(batch: TensorDictBase, learner: Learner) -> None:
    """Check a batch for the entries that a learner reads, see `check_entries`."""
    check_entries(batch, learner.in_keys, type(learner).__name__)


def check_entries(batch: TensorDictBase, keys: Sequence[NestedKey], reader: str) -> None:
    """Check a batch for entries.

    Raises:
        InputError: An entry is missing; it is named.
    """
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


def accumulate(
    batch: TensorDictBase,
    losses: Callable[[TensorDictBase], TensorDictBase],
    chunk_frames: int,
    *,
    is_sum: bool = False,
) -> dict[str, float]:
    """Add the gradient of steps (num_steps,) to the parameters, chunk by chunk.

    Args:
        batch: The steps.
        losses: Returns the terms of the loss, `loss_*`, and other metrics.
        chunk_frames: Steps in one forward and backward pass; bounds memory and affects rounding.
        is_sum: Whether the terms are sums over steps; means otherwise.

    Returns:
        Terms and metrics of the whole batch, by name.

    Raises:
        NotANumberError: A term is NaN or infinite.
    """
    totals: dict[str, float] = {}
    for chunk in batch.split(chunk_frames):
        share = len(chunk) / len(batch)
        weight = 1.0 if is_sum else share
        metrics = losses(chunk)
        terms = {k: v for k, v in metrics.items() if k.startswith("loss_")}
        for name, value in terms.items():
            check_finite(value, name)
        total: Any = sum(terms.values())  # not the 0 that it begins with
        (total * weight).backward()
        for name, value in metrics.items():
            part = float(value.detach()) * (weight if name in terms else share)
            totals[name] = totals.get(name, 0.0) + part
    return totals


def descend(
    optimiser: torch.optim.Optimizer,
    parameters: Iterable[tuple[str, nn.Parameter]],
    max_norm: float | None,
) -> float:
    """Step the optimizer. Returns the gradient's norm before it was clipped to `max_norm`.

    Raises:
        NotANumberError: The gradient is NaN or infinite; no parameter was changed.
    """
    known = {name: p for name, p in parameters if p.grad is not None}
    gradients = {name: p.grad for name, p in known.items() if p.grad is not None}
    norm = get_total_norm(gradients.values())
    if not bool(torch.isfinite(norm)):  # or finite numbers whose squares are not
        for name, gradient in gradients.items():
            check_finite(gradient, f"the gradient of {name}")
    if max_norm is not None:
        clip_grads_with_norm_(known.values(), max_norm, norm)
    optimiser.step()
    return float(norm)
