"""Flights that move back and forth and get nowhere."""

import dataclasses
from typing import Any

import numpy as np

from drone_rl.explanations.dataset import RolloutDataset
from drone_rl.sim.actions import Actions
from drone_rl.utils.intervals import proportion


@dataclasses.dataclass(frozen=True)
class Loop:
    """A stretch of an episode in which the drone moves back and forth and gets nowhere."""

    first: int
    """Its first frame."""
    length: int
    """Frames."""
    reversals: int
    """Moves that undo the one before."""


def find_loops(dataset: RolloutDataset, actions: Actions, min_reversals: int = 2) -> list[Loop]:
    """Runs of moves that can be undone, no other among them, that turn round at least so often.

    Args:
        dataset: Whole flights.
        actions: What can be done in them; forward is a move that nothing undoes.
        min_reversals: Two turns: back where it was, and away again.
    """
    moves, episode = dataset.tensor("actions"), dataset.episode
    sways = actions.sways({name: dataset.tensor(name) for name in actions.fields()})
    turns = actions.undoes(moves[1:], moves[:-1])
    loops, start = [], 0
    for t in range(1, len(moves) + 1):
        ends = t == len(moves) or episode[t] != episode[start]
        if not ends and sways[t] and sways[start]:
            continue
        if sways[start]:
            reversals = int(turns[start : t - 1].sum())
            if reversals >= min_reversals:
                loops.append(Loop(start, t - start, reversals))
        start = t
    return loops


def summarise_loops(flights: RolloutDataset, loops: list[Loop]) -> dict[str, Any]:
    """Counts for people and programs; "episodes" is the share of flights with a loop."""
    looping = len({int(flights.episode[loop.first]) for loop in loops})
    return {
        "loops": len(loops),
        "longest": max((loop.length for loop in loops), default=0),
        "frames_share": sum(loop.length for loop in loops) / len(flights),
        "episodes": proportion(looping, len(np.unique(flights.episode))),
        "list": [dataclasses.asdict(loop) for loop in loops],
    }
