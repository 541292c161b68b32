"""Sections "verdict", "shifts" (robustness), "dataset" (rollout statistics) and "flaws"."""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import cdist

from drone_rl.explanations.context import Context, needs, objects
from drone_rl.explanations.results import Dataset, Flaws, Loop, Pair
from drone_rl.explanations.rollouts import RolloutDataset
from drone_rl.sim.actions import Actions
from drone_rl.trust.results import Verdict
from drone_rl.trust.rule import Rule
from drone_rl.trust.shifts_results import SavedShifts
from drone_rl.trust.verdict import judge_policy
from drone_rl.utils.intervals import mean_interval, proportion

ALIKE_METRES = 1.0  # next targets that differ by at most this along each axis are at the same place
MIN_OPPOSITION = 0.2  # pairs with a smaller opposition are ignored


def verdict_section(context: Context) -> Verdict:
    """Judge the policy on held-out episodes."""
    return judge_policy(
        context.env,
        context.restart(),
        context.settings.episodes,
        rule=Rule(good_share=context.settings.good_share),
        claim=context.claim,
        unlike=context.unlike,
        known_scenes=context.known_scenes,
        seed=context.seed,
    )


def shifts_section(context: Context) -> SavedShifts | None:
    """Return the robustness that was measured, if any."""
    return context.measured


def dataset_section(context: Context) -> Dataset:
    """Return statistics of the recorded rollouts."""
    data, flights = context.dataset, context.flights
    probs = data.probabilities.astype(np.float64)
    entropy = -(probs * np.log(np.maximum(probs, 1e-12))).sum(-1) / np.log(probs.shape[-1])
    counts = np.bincount(flights.actions, minlength=probs.shape[-1])
    return Dataset(
        frames=len(data),
        episodes=len(np.unique(flights.episode)),
        steps=len(flights),
        action_shares=(counts / counts.sum()).tolist(),
        entropy=mean_interval(entropy.clip(0.0, 1.0), data.episode),
        goals_reached=int((flights.event > 0).sum()),
        remembers=context.remembers,
    )


def without_excuse(context: Context) -> str | None:
    """Need nothing but the next target's place to justify an action."""
    if context.remembers:
        return "The policy remembers earlier frames, which may justify opposite actions."
    return objects(context)


@needs(contradictions=without_excuse)
def flaws_section(context: Context) -> Flaws:
    """Find contradictions (Fig. 9) of the analysed frames, and loops of whole episodes."""
    data, flights, scenes = context.dataset, context.flights, context.scenes
    alike = median_change(flights.observations, flights.episode)
    loops = find_loops(flights, scenes.actions)
    looping = len({int(flights.episode[loop.first]) for loop in loops})
    offset = data.offset(scenes.worlds) * (np.nan if context.remembers else 1.0)
    others = {n: median_change(of.numpy(), flights.episode) for n, of in flights.others.items()}
    return Flaws(
        pairs=tuple(find_pairs(data, alike, scenes.actions, offset, others)),
        alike_metres=ALIKE_METRES,
        loops=tuple(loops),
        looping_steps=sum(loop.length for loop in loops) / len(flights),
        looping_episodes=proportion(looping, len(np.unique(flights.episode))),
    )


def median_change(seen: NDArray, episode: NDArray) -> float:
    """Return the median root mean square difference of successive values of an input.

    Those that differ by no more count as similar. Shapes: (T, *) and (T,).
    """
    follows = np.flatnonzero(episode[1:] == episode[:-1])
    changes = [float(np.sqrt(np.mean((seen[t + 1] - seen[t]) ** 2))) for t in follows]
    return float(np.median(changes or [0.0]))


def find_pairs(
    dataset: RolloutDataset,
    alike: float,
    actions: Actions,
    offset: NDArray,
    others: Mapping[str, float] = MappingProxyType({}),
) -> list[Pair]:
    """Find similar frames with opposite actions, most opposed first; a frame is in one pair only.

    Observations are similar up to a root mean square difference of `alike`, and other inputs up to
    that in `others`. `offset` has the metres ahead and to the left of the next target, NaN without
    one. Shape: (T, 2).
    """
    probs = dataset.probabilities
    every = []
    for start in range(0, len(dataset), 500):
        rows = slice(start, start + 500)
        distance = _differences(dataset.observations, rows)
        swing = actions.opposition(probs[rows, None], probs[None])
        is_pair = (distance <= alike) & (swing >= MIN_OPPOSITION)
        for name, limit in others.items():
            is_pair &= _differences(dataset.others[name].numpy(), rows) <= limit
        for i, j in zip(*np.nonzero(is_pair), strict=True):
            every.append((-float(swing[i, j]), float(distance[i, j]), start + int(i), int(j)))
    used: set[int] = set()
    pairs = []
    for negative, distance, left, right in sorted(every, key=lambda pair: pair[:2]):
        if used & {left, right}:
            continue
        used |= {left, right}
        away = np.abs(offset[left] - offset[right]).max()
        kind = "contradiction" if away <= ALIKE_METRES else "justified"
        kind = "unknown" if np.isnan(away) else kind
        pairs.append(
            Pair(left=left, right=right, distance=distance, opposition=-negative, kind=kind)
        )
    return pairs


def _differences(seen: NDArray, rows: slice) -> NDArray:
    """Return root mean square differences of some inputs to all. Shape: (T, *) to (N, T)."""
    flat = seen.reshape(len(seen), -1).astype(np.float64)
    return cdist(flat[rows], flat) / np.sqrt(flat.shape[1])


def find_loops(flights: RolloutDataset, actions: Actions) -> list[Loop]:
    """Find parts of an episode in which the drone moves back and forth.

    Each is a run of reversible moves, of which at least two undo the one before: the drone is
    back where it was, and away again. No such move goes forward.
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
            loops.append(Loop(first=int(start), length=int(end - start), reversals=reversals))
    return loops
