"""Sections "evaluation", "shifts" (robustness), "dataset" (rollout statistics) and "flaws"."""

import dataclasses
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import cdist

from drone_rl.explanations.context import Context
from drone_rl.explanations.rollouts import RolloutDataset
from drone_rl.sim.actions import Actions
from drone_rl.trust.rule import Rule
from drone_rl.trust.verdict import judge_policy
from drone_rl.utils.intervals import mean_interval, proportion

ALIKE_METRES = 1.0  # next targets that differ by at most this along each axis are at the same place
MIN_OPPOSITION = 0.2  # pairs with a smaller opposition are ignored
LISTED = 50  # number of pairs that are listed; all are counted


def evaluation_section(context: Context) -> tuple[dict[str, Any], dict[str, NDArray]]:
    """Return "verdict", on held-out episodes."""
    verdict = judge_policy(
        context.env,
        context.restart(),
        context.settings.episodes,
        rule=Rule(good_share=context.settings.good_share),
        claim=context.claim,
        unlike=context.unlike,
        seed=context.seed,
    )
    return {"verdict": verdict.as_dict()}, {}


def shifts_section(context: Context) -> tuple[dict[str, Any], dict[str, NDArray]]:
    """Return "shifts", as in `shifts.json`, or why it is "refused"; nothing without such a file.

    Arrays: "shifts_..." of each axis, frames without a shift and at the five strengths, black where
    the task can't be changed so. Shapes: (6, H, W, 3).
    """
    if (measured := context.measured) is None:
        return {}, {}
    strips = (
        {name: measured.shifts.frames(name) for name in measured.shifts.axes}
        if measured.shifts
        else {}
    )
    arrays = {
        f"shifts_{name}": np.stack([np.zeros_like(strip[0]) if p is None else p for p in strip])
        for name, strip in strips.items()
    }
    saved = measured.model_dump(mode="json", exclude={"shifts": {"pictures"}})
    return {"shifts": saved}, arrays


def dataset_section(context: Context) -> tuple[dict[str, Any], dict[str, NDArray]]:
    """Return "dataset"."""
    data, flights = context.dataset, context.flights
    probs = data.probabilities.astype(np.float64)
    entropy = -(probs * np.log(np.maximum(probs, 1e-12))).sum(-1) / np.log(probs.shape[-1])
    counts = np.bincount(flights.actions, minlength=probs.shape[-1])
    numbers = {
        "frames": len(data),
        "episodes": len(np.unique(flights.episode)),
        "steps": len(flights),
        "action_shares": (counts / counts.sum()).tolist(),
        "entropy": mean_interval(entropy.clip(0.0, 1.0), data.episode).model_dump(),
        "goals_reached": int((flights.event > 0).sum()),
        **({"remembers": True} if context.remembers else {}),
    }
    return {"dataset": numbers}, {}


def flaws_section(context: Context) -> tuple[dict[str, Any], dict[str, NDArray]]:
    """Return "contradictions" (Fig. 9) of the analysed frames, and "loops" of whole episodes."""
    data, flights, scenes = context.dataset, context.flights, context.scenes
    alike = median_frame_change(flights)
    pairs = find_pairs(data, alike, scenes.actions, data.offset(scenes.task))
    numbers = {
        "contradictions": summarise_pairs(pairs, data),
        "loops": summarise_loops(flights, find_loops(flights, scenes.actions)),
    }
    return numbers, {}


@dataclasses.dataclass(frozen=True)
class Pair:
    """Two similar frames with opposite actions.

    It is a "contradiction" if the next target is at about the same place in both, "justified" if it
    is elsewhere, and "unknown" if one of the frames has none.
    """

    left: int  # the frame with the higher probability of left
    right: int  # the frame with the higher probability of right
    distance: float  # root mean square difference of the observations
    opposition: float  # from 0 to 1; see `Actions.opposition`
    kind: Literal["contradiction", "justified", "unknown"]


def median_frame_change(flights: RolloutDataset) -> float:
    """Return the median root mean square difference of successive observations.

    Observations that differ by no more count as similar.
    """
    seen = flights.observations
    follows = np.flatnonzero(flights.episode[1:] == flights.episode[:-1])
    changes = [float(np.sqrt(np.mean((seen[t + 1] - seen[t]) ** 2))) for t in follows]
    return float(np.median(changes or [0.0]))


def find_pairs(
    dataset: RolloutDataset, alike: float, actions: Actions, offset: NDArray
) -> list[Pair]:
    """Find similar frames with opposite actions, most opposed first; a frame is in one pair only.

    Observations are similar up to a root mean square difference of `alike`. `offset` has the metres
    ahead and to the left of the next target, NaN without one. Shape: (T, 2).
    """
    flat = dataset.observations.reshape(len(dataset), -1).astype(np.float64)
    probs = dataset.probabilities
    every = []
    for start in range(0, len(flat), 500):
        rows = slice(start, start + 500)
        distance = cdist(flat[rows], flat) / np.sqrt(flat.shape[1])
        swing = actions.opposition(probs[rows, None], probs[None])
        for i, j in zip(*np.nonzero((distance <= alike) & (swing >= MIN_OPPOSITION)), strict=True):
            left, right = start + int(i), int(j)
            away = np.abs(offset[left] - offset[right]).max()
            kind = "contradiction" if away <= ALIKE_METRES else "justified"
            kind = "unknown" if np.isnan(away) else kind
            every.append(Pair(left, right, float(distance[i, j]), float(swing[i, j]), kind))
    used: set[int] = set()
    kept = []
    for pair in sorted(every, key=lambda pair: (-pair.opposition, pair.distance)):
        if not used & {pair.left, pair.right}:
            used |= {pair.left, pair.right}
            kept.append(pair)
    return kept


def summarise_pairs(pairs: list[Pair], dataset: RolloutDataset) -> dict[str, Any]:
    """Return counts by kind, and the first pairs."""
    worst = [pair.opposition for pair in pairs if pair.kind == "contradiction"]
    return {
        "frames": len(dataset),
        "episodes": len(np.unique(dataset.episode)),
        "pairs": len(pairs),
        "contradictions": len(worst),
        "justified": sum(pair.kind == "justified" for pair in pairs),
        "unknown": sum(pair.kind == "unknown" for pair in pairs),
        "worst_opposition": max(worst, default=None),
        "alike_metres": ALIKE_METRES,
        "list": [dataclasses.asdict(pair) for pair in pairs[:LISTED]],
    }


def find_loops(flights: RolloutDataset, actions: Actions) -> list[dict[str, int]]:
    """Find stretches of an episode in which the drone moves back and forth.

    Each is a run of reversible moves, of which at least two undo the one before: the drone is
    back where it was, and away again. No move undoes forward.
    """
    moves, episode = flights.tensor("actions"), flights.episode
    kept = {name: flights.tensor(name) for name in actions.fields()}
    reversible = actions.is_reversible(kept).numpy()
    turns = actions.undoes(moves[1:], moves[:-1])
    is_new = (np.diff(episode) != 0) | (np.diff(reversible.astype(int)) != 0)
    starts = np.flatnonzero(np.concatenate([[True], is_new]))
    loops = []
    for start, end in zip(starts, [*starts[1:], len(moves)], strict=True):
        reversals = int(turns[start : end - 1].sum())
        if reversals >= 2 and reversible[start]:
            loop = {"first": int(start), "length": int(end - start), "reversals": reversals}
            loops.append(loop)
    return loops


def summarise_loops(flights: RolloutDataset, loops: list[dict[str, int]]) -> dict[str, Any]:
    """Return counts; "episodes" is the fraction of episodes with a loop."""
    looping = len({int(flights.episode[loop["first"]]) for loop in loops})
    return {
        "loops": len(loops),
        "longest": max((loop["length"] for loop in loops), default=0),
        "frames_share": sum(loop["length"] for loop in loops) / len(flights),
        "episodes": proportion(looping, len(np.unique(flights.episode))).model_dump(),
        "list": loops,
    }
