"""From a batch to one step of an optimiser, in bounded memory."""

from collections.abc import Callable, Iterable
from typing import Any

import torch
from tensordict import TensorDictBase
from torch import nn
from torch.nn.utils import clip_grads_with_norm_, get_total_norm

from drone_rl.training.learners.learner import check_finite


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
