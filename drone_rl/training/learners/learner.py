"""What a trainer knows of learning, whatever is learned and how."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, Protocol

import torch
from tensordict import TensorDictBase
from tensordict.utils import NestedKey
from torch import Tensor, nn
from torch.nn.utils import clip_grads_with_norm_, get_total_norm

from drone_rl.utils.errors import InputError


class NotANumberError(RuntimeError):
    """A loss or gradient was NaN or infinite; the parameters were left as they were."""


class Learner(Protocol):
    """One update from one batch.

    A learner holds all that learning needs, networks, losses and optimisers, and decides what to
    do with a batch: how often to pass over it, in which pieces, with which critics. Batches come
    as a collector gives them: complete episodes one after the other, shape (T_total,), or pieces
    of fixed length, shape (num_envs, T).
    """

    @property
    def in_keys(self) -> Sequence[NestedKey]:
        """Entries that a batch must hold."""
        ...

    def update(self, batch: TensorDictBase) -> dict[str, float]:
        """Learns from a batch.

        Returns:
            Metrics by name, the same names at every update.

        Raises:
            NotANumberError: The parameters would no longer be numbers; they are as before.
            InputError: The batch can't be learned from.
        """
        ...

    def state_dict(self) -> dict[str, Any]:
        """All that the next update depends on; the weights of the policy are its "policy"."""
        ...

    def check_state(self, state: Mapping[str, Any]) -> None:
        """Refuses, before anything is taken over, a state that is not one of this learner.

        Args:
            state: Has the keys of `state_dict`, and may come from anywhere.

        Raises:
            InputError: It is none; the first difference is named.
        """
        ...

    def load_state_dict(self, state: Mapping[str, Any]) -> None:
        """Goes on from a state."""
        ...


def check_batch(batch: TensorDictBase, learner: Learner) -> None:
    """Refuse a batch that lacks an entry which a learner reads.

    Raises:
        InputError: An entry is missing; it is named.
    """
    check_entries(batch, learner.in_keys, type(learner).__name__)


def check_entries(batch: TensorDictBase, keys: Sequence[NestedKey], reader: str) -> None:
    """Refuse a batch that lacks an entry.

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
    """Refuses to learn from what is no number.

    Raises:
        NotANumberError: A value is NaN or infinite.
    """
    if not bool(torch.isfinite(value).all()):
        raise NotANumberError(f"{name} is NaN or infinite")


def accumulate(
    batch: TensorDictBase,
    losses: Callable[[TensorDictBase], TensorDictBase],
    chunk_frames: int,
    *,
    is_sum: bool = False,
) -> dict[str, float]:
    """Adds the gradient of a batch to the parameters, chunk by chunk.

    Args:
        batch: Steps. Shape: (num_steps,).
        losses: Gives the terms of the loss, `loss_*`, and figures beside them.
        chunk_frames: Steps in one forward and backward pass; bounds memory; sums are
            rounded by it in their last places.
        is_sum: Whether the terms are sums over steps; means otherwise.

    Returns:
        The terms and figures of the whole batch, by name.

    Raises:
        NotANumberError: A term is NaN or infinite.
    """
    totals: dict[str, float] = {}
    for chunk in batch.split(chunk_frames):
        share = len(chunk) / len(batch)
        weight = 1.0 if is_sum else share
        told = losses(chunk)
        terms = {k: v for k, v in told.items() if k.startswith("loss_")}
        for name, value in terms.items():
            check_finite(value, name)
        total: Any = sum(terms.values())  # not the 0 that it begins with
        (total * weight).backward()
        for name, value in told.items():
            part = float(value.detach()) * (weight if name in terms else share)
            totals[name] = totals.get(name, 0.0) + part
    return totals


def descend(
    optimiser: torch.optim.Optimizer,
    parameters: Iterable[tuple[str, nn.Parameter]],
    max_norm: float | None,
) -> float:
    """A step along the gradient, and its norm before it was clipped.

    Args:
        optimiser: Over the parameters.
        parameters: By name.
        max_norm: Clip to this norm; None for no clipping.

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
