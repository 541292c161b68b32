"""The flaw of Fig. 9, found by program: alike pictures, opposite actions."""

import dataclasses
import enum
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import cdist

from drone_rl.explanations.dataset import RolloutDataset
from drone_rl.sim.actions import Actions

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
