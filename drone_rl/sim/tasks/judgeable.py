"""What verdicts must know of a task: its goals, what luck and knowledge get, how goals differ."""

import dataclasses
import enum
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple, Protocol

import torch
from torch import Tensor

from drone_rl.sim.actions import Actions
from drone_rl.sim.vocabulary import Terms
from drone_rl.utils.batch import Batch


@dataclasses.dataclass
class Goals(Batch):
    """What `n` finished episodes had to do: `C` goals each, in the order in which they come up."""

    reached: Tensor  # (n, C) bool
    """Which of them were reached."""
    stratum: Tensor  # (n, C) int64
    """Where each stood when it came up, one of `Judgeable.strata`; -1 if it never did."""
    world: Tensor  # (n, k)
    """What was drawn for each episode; it tells worlds apart whatever was done in them."""


class OracleRule(NamedTuple):
    """The best way to act for those who know the truth."""

    reads: tuple[str, ...]
    """Entries of the information that it looks at."""
    act: Callable[..., Tensor]
    """Actions of them. Each shape: (num_worlds, *); the actions': (num_worlds,), then the
    entry's."""
    actions: Actions
    """What it acts with."""

    def can_fly(self, actions: Actions) -> bool:
        """Whether others have parts that are called as its own actions are."""
        return set(self.actions.names) <= set(actions.names)

    def decide(self, known: Sequence[Tensor], actions: Actions) -> Tensor:
        """What to do with a set of actions.

        Where they are not its own, it takes what is called the same, at full speed.

        Args:
            known: What it reads. Each shape: (num_worlds, *).
            actions: Such as it can fly.

        Returns:
            Shape: (num_worlds,), then the entry's.
        """
        own = self.act(*known)
        if actions == self.actions:
            return own
        same = torch.stack([actions.always(name) for name in self.actions.names])
        return same.to(own.device)[self.actions.part(own)]


class Judgeable(Protocol):
    """How good an episode was. An episode is a success if all its goals are reached."""

    @property
    def name(self) -> str:
        """What people call the task."""
        ...

    @property
    def terms(self) -> Terms:
        """What people call its goals and targets, and what becomes of them."""
        ...

    @property
    def ends(self) -> type[enum.IntEnum]:
        """Why an episode ends; 0 says that it goes on."""
        ...

    @property
    def success_end(self) -> int:
        """The one of `ends` that says that all goals are reached."""
        ...

    @property
    def expected_end(self) -> int:
        """How an episode ends in which a goal was missed and nothing else went wrong."""
        ...

    @property
    def strata(self) -> tuple[str, ...]:
        """Where a goal can stand, from left to right: verdicts count each apart."""
        ...

    @property
    def luck(self) -> tuple[str, ...]:
        """What needs no eyes: "random", and names of actions that are taken always."""
        ...

    @property
    def scored(self) -> tuple[str, ...]:
        """Entries of an episode's last information from which `score` makes its goals."""
        ...

    @property
    def oracle(self) -> OracleRule | None:
        """How one acts who knows the truth; None if nobody knows."""
        ...

    def score(self, info: Mapping[str, Tensor]) -> Goals:
        """What became of the goals.

        Args:
            info: The entries `scored` at the ends of episodes. Shapes: (n, *).
        """
        ...

    def classes(self, goals: Any) -> Iterator[tuple[str, str, Tensor]]:
        """Classes of goals that failure tables count by.

        Args:
            goals: From `score`.

        Yields:
            What is looked at, its value, and which goals have it. Shape of these: (n, C), bool.
        """
        ...
