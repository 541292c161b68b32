"""The flaw of Fig. 9, found by program: alike pictures, opposite actions."""

import dataclasses
import enum
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import cdist

from drone_rl.explanations.context import Context
from drone_rl.explanations.rollouts import RolloutDataset
from drone_rl.sim.actions import Actions
from drone_rl.utils.intervals import mean_interval, proportion

ALIKE_METRES = 1.0
"""Next cubes stand alike if their places seen from the drone differ by at most this."""
MIN_OPPOSITION = 0.2
"""Pairs less opposed than this are not worth a look."""
LISTED = 50
"""Pairs that are listed; all are counted."""


class Kind(enum.StrEnum):
    """What the simulator says of a pair."""

    CONTRADICTION = "contradiction"
    """The next cube stands alike in both, so that nothing justifies the difference."""
    JUSTIFIED = "justified"
    """It stands elsewhere."""
    UNKNOWN = "unknown"
    """One of the frames has no next cube."""


@dataclasses.dataclass(frozen=True)
class Pair:
    """Two frames that look alike and on which the policy wants opposite things."""

    left: int
    """The frame on which it wants to go left more."""
    right: int
    """The frame on which it wants to go right more."""
    distance: float
    """Root mean square difference of the pictures; see `picture_distance`."""
    opposition: float
    """0 to 1: what pulls left on the one frame and right on the other; see `opposition`."""
    kind: Kind


def one_move(flights: RolloutDataset) -> float:
    """How much one move changes a picture: the median over successive frames.

    Pictures that differ by no more are called alike. In what the policy gets, root mean square.
    """
    pictures = flights.observations
    follows = np.flatnonzero(flights.episode[1:] == flights.episode[:-1])
    if not len(follows):
        return 0.0
    changes = [float(np.sqrt(np.mean((pictures[t + 1] - pictures[t]) ** 2))) for t in follows]
    return float(np.median(changes))


def find_pairs(
    dataset: RolloutDataset, alike: float, actions: Actions, offset: NDArray
) -> list[Pair]:
    """Alike frames with opposite actions, the most opposed first; each frame in at most one pair.

    Args:
        dataset: Rollouts.
        alike: Root mean square difference up to which two pictures are alike.
        actions: What the policy can do.
        offset: Metres ahead and to the left of the next cube, NaN where there is none. (T, 2)
    """
    flat = dataset.observations.reshape(len(dataset), -1).astype(np.float64)
    probs = dataset.probabilities
    found = []
    for start in range(0, len(flat), 500):
        rows = slice(start, start + 500)
        distance = cdist(flat[rows], flat) / np.sqrt(flat.shape[1])
        swing = actions.opposition(probs[rows, None], probs[None])
        for i, j in zip(*np.nonzero((distance <= alike) & (swing >= MIN_OPPOSITION)), strict=True):
            left, right = start + int(i), int(j)
            kind = _kind(offset[left], offset[right])
            found.append(Pair(left, right, float(distance[i, j]), float(swing[i, j]), kind))
    found.sort(key=lambda pair: (-pair.opposition, pair.distance))
    return _apart(found)


def summarise_pairs(pairs: list[Pair], dataset: RolloutDataset, alike: float) -> dict[str, Any]:
    """Counts for people and programs, and the pairs that are listed."""
    worst = [pair.opposition for pair in pairs if pair.kind == Kind.CONTRADICTION]
    return {
        "frames": len(dataset),
        "episodes": len(np.unique(dataset.episode)),
        "pairs": len(pairs),
        "contradictions": len(worst),
        "justified": sum(pair.kind == Kind.JUSTIFIED for pair in pairs),
        "unknown": sum(pair.kind == Kind.UNKNOWN for pair in pairs),
        "worst_opposition": max(worst, default=None),
        "alike": alike,
        "alike_metres": ALIKE_METRES,
        "min_opposition": MIN_OPPOSITION,
        "list": [dataclasses.asdict(pair) for pair in pairs[:LISTED]],
    }


def _kind(offset: NDArray, other: NDArray) -> Kind:
    """Of a pair whose next cubes stand there, seen from the drone; NaN where there is none."""
    away = np.abs(offset - other).max()
    if np.isnan(away):
        return Kind.UNKNOWN
    return Kind.CONTRADICTION if away <= ALIKE_METRES else Kind.JUSTIFIED


def _apart(pairs: list[Pair]) -> list[Pair]:
    seen: set[int] = set()
    kept = []
    for pair in pairs:
        if not seen & {pair.left, pair.right}:
            seen |= {pair.left, pair.right}
            kept.append(pair)
    return kept


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


def flaws_section(context: Context) -> tuple[dict[str, Any], dict[str, NDArray]]:
    """Makes "contradictions", of the frames analysed, and "loops", of the whole flights."""
    data, flights = context.dataset, context.flights
    alike = one_move(flights)
    scenes = context.scenes
    pairs = find_pairs(data, alike, scenes.actions, data.offset(scenes.task))
    numbers = {
        "contradictions": summarise_pairs(pairs, data, alike),
        "loops": summarise_loops(flights, find_loops(flights, scenes.actions)),
    }
    return numbers, {}


def dataset_section(context: Context) -> tuple[dict[str, Any], dict[str, NDArray]]:
    """Makes "dataset"."""
    data, flights = context.dataset, context.flights
    probs = data.probabilities.astype(np.float64)
    entropy = -(probs * np.log(np.maximum(probs, 1e-12))).sum(-1) / np.log(probs.shape[-1])
    counts = np.bincount(flights.actions, minlength=probs.shape[-1])
    numbers = {
        "frames": len(data),
        "episodes": len(np.unique(flights.episode)),
        "steps": len(flights),
        "action_shares": (counts / counts.sum()).tolist(),
        "entropy": mean_interval(entropy.clip(0.0, 1.0), data.episode),
        "goals_reached": int((flights.event > 0).sum()),
    }
    return {"dataset": numbers}, {}
