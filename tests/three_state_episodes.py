"""Every possible episode of the three-state process, so that expectations become sums."""

from collections.abc import Sequence
from typing import NamedTuple

from drone_rl.envs.three_state import SUCCESS_PROBABILITY


class PossibleEpisode(NamedTuple):
    """One possible episode."""

    probability: float
    actions: tuple[int, ...]
    rewards: tuple[float, ...]


def outcomes(leaving: Sequence[float]) -> list[PossibleEpisode]:
    """Return every possible episode, so expectations become sums.

    Args:
        leaving: The policy's probability of action 1 in state 0 at each step; as many as `horizon`.
    """
    episodes, still_there = [], 1.0
    for t, leave in enumerate(leaving):
        actions, waited = (*[0] * t, 1), (0.0,) * t
        success, failure = SUCCESS_PROBABILITY, 1 - SUCCESS_PROBABILITY
        episodes.append(PossibleEpisode(still_there * leave * success, actions, (*waited, 1.0)))
        episodes.append(PossibleEpisode(still_there * leave * failure, actions, (*waited, 0.0)))
        still_there *= 1 - leave
    stayed = len(leaving)
    return [*episodes, PossibleEpisode(still_there, (0,) * stayed, (0.0,) * stayed)]
