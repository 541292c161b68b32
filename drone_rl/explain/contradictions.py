"""The flaw of Fig. 9, found by program: alike pictures, opposite actions; and flights in a loop."""

import dataclasses
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import cdist

from drone_rl.explain.dataset import RolloutDataset
from drone_rl.sim.rules import Action

ALIKE_METRES = 1.0
"""Next cubes stand alike if their places seen from the drone differ by at most one move."""
CANDIDATES = 25
"""Nearest pictures to which each is compared."""
MIN_OPPOSITION = 0.2
"""Pairs less opposed than this are not worth a look."""


@dataclasses.dataclass(frozen=True)
class Pair:
    """Two frames that look alike and on which the policy wants opposite things."""

    left: int
    """The frame on which it wants to go left more."""
    right: int
    """The frame on which it wants to go right more."""
    distance: float
    """Root mean square difference of the pictures, in units of the pictures' own deviation."""
    opposition: float
    """0 to 1: what pulls left on the one frame and right on the other; see `opposition`."""
    score: float
    """By which pairs are ranked: opposition times closeness."""
    contradiction: bool
    """Whether the next cube stands alike in both, so that nothing justifies the difference."""


def opposition(probabilities: NDArray, others: NDArray) -> NDArray:
    """How opposed two policies' wishes are: the lesser of the swings to the left and to the right.

    Args:
        probabilities: Shape (*, 3), by `Action`.
        others: Shape (*, 3).

    Returns:
        0 (both want the same) to 1 (surely left, surely right). Positive where the first is the
        one that wants left. Shape: (*).
    """
    swing = probabilities - others
    to_left, to_right = swing[..., Action.LEFT], -swing[..., Action.RIGHT]
    agreed = np.sign(to_left) == np.sign(to_right)
    return np.where(agreed, np.sign(to_left) * np.minimum(np.abs(to_left), np.abs(to_right)), 0.0)


def find_pairs(dataset: RolloutDataset, most: int = 50) -> list[Pair]:
    """Alike frames with opposite actions, the worst first; each frame in at most one pair.

    Args:
        dataset: Rollouts.
        most: How many pairs are kept.
    """
    flat = dataset.observations.reshape(len(dataset), -1).astype(np.float64)
    # both measured relative to what the pictures differ by at all
    scale = max(float(flat.std(0).mean()) * np.sqrt(flat.shape[1]), 1e-12)
    candidates = _candidate_pairs(flat / scale, dataset.probabilities)
    offset = dataset.offset()
    pairs = [_describe(i, j, d, o, offset) for i, j, d, o in candidates]
    pairs.sort(key=lambda pair: -pair.score)
    return _apart(pairs, most)


def summarise_pairs(pairs: list[Pair]) -> dict[str, Any]:
    """Counts for people and programs."""
    contradictions = [pair for pair in pairs if pair.contradiction]
    return {
        "pairs": len(pairs),
        "contradictions": len(contradictions),
        "justified": len(pairs) - len(contradictions),
        "worst_opposition": max((p.opposition for p in contradictions), default=0.0),
        "alike_metres": ALIKE_METRES,
        "min_opposition": MIN_OPPOSITION,
    }


def _candidate_pairs(flat: NDArray, probs: NDArray) -> list[tuple[int, int, float, float]]:
    found = []
    for start in range(0, len(flat), 500):
        distance = cdist(flat[start : start + 500], flat)
        count = min(CANDIDATES + 1, len(flat))
        nearest = np.argpartition(distance, count - 1, axis=1)[:, :count]
        for row, columns in enumerate(nearest):
            i = start + row
            swings = opposition(probs[i], probs[columns])
            found += [
                (i, int(j), float(distance[row, j]), float(swing))
                for j, swing in zip(columns, swings, strict=True)
                if swing >= MIN_OPPOSITION
            ]
    return found


def _describe(i: int, j: int, distance: float, opposed: float, offset: NDArray) -> Pair:
    away = np.abs(offset[i] - offset[j]).max()  # NaN where a frame has no next cube
    return Pair(
        left=i,
        right=j,
        distance=distance,
        opposition=opposed,
        score=opposed / (1.0 + distance),
        contradiction=bool(away <= ALIKE_METRES),
    )


def _apart(pairs: list[Pair], most: int) -> list[Pair]:
    seen: set[int] = set()
    kept = []
    for pair in pairs:
        if not seen & {pair.left, pair.right}:
            seen |= {pair.left, pair.right}
            kept.append(pair)
    return kept[:most]


@dataclasses.dataclass(frozen=True)
class Loop:
    """A stretch of an episode in which the drone moves back and forth and gets nowhere."""

    first: int
    """Its first frame."""
    length: int
    """Frames."""
    reversals: int
    """Changes between left and right."""


def find_loops(dataset: RolloutDataset, min_reversals: int = 2) -> list[Loop]:
    """Runs of sideways moves, no forward one among them, that turn round at least so often.

    Args:
        dataset: Rollouts.
        min_reversals: Two turns: back where it was, and away again.
    """
    actions, episode = dataset.actions, dataset.episode
    loops, start = [], 0
    for t in range(1, len(actions) + 1):
        ends = t == len(actions) or episode[t] != episode[start]
        if not ends and actions[t] != Action.FORWARD and actions[start] != Action.FORWARD:
            continue
        moves = actions[start:t]
        if actions[start] != Action.FORWARD:
            reversals = int((moves[1:] != moves[:-1]).sum())
            if reversals >= min_reversals:
                loops.append(Loop(start, len(moves), reversals))
        start = t
    return loops


def summarise_loops(dataset: RolloutDataset, loops: list[Loop]) -> dict[str, Any]:
    """Counts for people and programs."""
    episodes = len(np.unique(dataset.episode))
    looping = len({int(dataset.episode[loop.first]) for loop in loops})
    return {
        "loops": len(loops),
        "longest": max((loop.length for loop in loops), default=0),
        "frames_share": sum(loop.length for loop in loops) / len(dataset),
        "episodes": episodes,
        "episodes_with_loops": looping,
    }
