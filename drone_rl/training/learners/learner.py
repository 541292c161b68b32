"""What a trainer knows of learning, whatever is learned and how."""

from collections.abc import Mapping, Sequence
from typing import Any, Protocol

import torch
from tensordict import TensorDictBase
from tensordict.utils import NestedKey
from torch import Tensor

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
    """Refuses a batch that lacks what a learner learns from.

    Raises:
        InputError: An entry is missing; it is named.
    """
    held = batch.keys(include_nested=True)
    for key in learner.in_keys:
        if key not in held:
            raise InputError(
                f"a batch has no entry {key!r}, which {type(learner).__name__} learns from; use a "
                "collector that keeps it, such as collector=rollouts"
            )


def check_finite(value: Tensor, name: str) -> None:
    """Refuses to learn from what is no number.

    Raises:
        NotANumberError: A value is NaN or infinite.
    """
    if not bool(torch.isfinite(value).all()):
        raise NotANumberError(f"{name} is NaN or infinite")
