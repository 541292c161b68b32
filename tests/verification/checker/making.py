"""True certificates without a prover: of one cube by bisection, of any boxes by hand."""

import itertools

import numpy as np

import drone_rl
from drone_rl.sim.tasks.collect_cubes import EndReason
from drone_rl.verification.checker import fingerprint
from drone_rl.verification.checker.rollouts import Simulator

BAND = 1e-5
"""Metres on either side of a border that are left undecided."""


def certificate_of(policy, outcomes, undecided, share_undecided, finished=True):
    """The file's content."""
    return {
        "format": "drone_rl certificate",
        "format_version": 1,
        "policy": {
            "name": policy.name,
            "weights": fingerprint(policy.state["policy"]),
            "description": policy.description.as_dict(),
        },
        "outcomes": outcomes,
        "undecided": {"share": share_undecided, "boxes": undecided},
        "finished": finished,
        "stated": {"logit_gap": 1e-4, "largest_band": BAND, "renderer": "Raytracer"},
        "found": {"least_gap": 0.0, "pictures": 1, "states": 1, "seconds": 1.0},
    }


def of_one_cube(name, **task):
    """Flies a grid and halves every step of it at whose sides flights end otherwise."""
    policy = drone_rl.load_policy(name).in_task(num_cubes=1, **task)
    simulator = Simulator(policy.description, policy.state["policy"])
    bound = policy.task.lateral_bound

    def ends(y):
        flown = simulator.fly(np.asarray(y)[:, None])
        collected = flown.collected[:, 0].tolist()
        return list(zip(flown.end.tolist(), collected, flown.steps.tolist(), strict=True))

    y = np.linspace(-bound, bound, 401)
    found = ends(y)
    sides = [i for i in range(400) if found[i] != found[i + 1]]
    low, high = y[sides], y[[i + 1 for i in sides]]
    while len(sides) and (high - low).max() > BAND / 4:
        middle = (low + high) / 2
        is_low = np.array([e == found[i] for e, i in zip(ends(middle), sides, strict=True)])
        low, high = np.where(is_low, middle, low), np.where(is_low, high, middle)
    simulator.close()
    cuts = [-bound, *((low + high) / 2).tolist(), bound]
    pieces = [found[0], *(found[i + 1] for i in sides)]
    return certificate_of(policy, *_as_outcomes(pieces, cuts))


def _as_outcomes(pieces, cuts):
    """Outcomes from the ends between cuts; around those where another outcome begins: undecided."""
    whole, stretches, undecided = cuts[-1] - cuts[0], {}, []
    spans = zip(pieces, itertools.pairwise(cuts), strict=True)
    for outcome, group in itertools.groupby(spans, key=lambda span: span[0][:2]):
        parts = [(end[2], *span) for end, span in group]
        low, high = parts[0][1], parts[-1][2]
        low += BAND if low > cuts[0] else 0.0
        if high < cuts[-1]:
            undecided.append([[high - BAND, high + BAND]])
            high -= BAND
        boxes, steps = stretches.setdefault(outcome, ([], {}))
        boxes.append([[low, high]])
        for number, start, stop in parts:
            inner = min(stop, high) - BAND - max(start, low) - BAND  # near them steps are not sure
            steps[number] = steps.get(number, 0.0) + inner
    outcomes = [
        {
            "end": EndReason(end).name.lower(),
            "collected": [collected],
            "loops": False,
            "share": _length(boxes) / whole,
            "steps": {str(k): v / whole for k, v in steps.items()},
            "boxes": boxes,
        }
        for (end, collected), (boxes, steps) in stretches.items()
    ]
    return outcomes, undecided, _length(undecided) / whole


def _length(boxes):
    return sum(high - low for ((low, high),) in boxes)


def steps_of(description, state, flights=300, high=None):
    """Which numbers of steps are how frequent from random placements, as a forger finds out.

    `high` bounds where the first cube may stand.
    """
    simulator = Simulator(description, state)
    bound, cubes = description.task.lateral_bound, description.task.num_cubes
    rng = np.random.default_rng(7)
    placements = rng.uniform(-bound, bound, (flights, cubes))
    placements[:, 0] = rng.uniform(-bound, bound if high is None else high, flights)
    flown = simulator.fly(placements)
    simulator.close()
    numbers, counts = np.unique(flown.steps, return_counts=True)
    return {str(n): c / flights for n, c in zip(numbers.tolist(), counts.tolist(), strict=True)}


def of_every_place(policy, end="all_cubes", undecided=False):
    """By hand and not by any proof: every flight ends so, but perhaps where y of a cube is > 3."""
    task = policy.description.task
    bound, cubes = task.lateral_bound, task.num_cubes
    stated, left = [[[-bound, bound]] * cubes], []
    if undecided:
        stated = [[[-bound, 3.0], *[[-bound, bound]] * (cubes - 1)]]
        left = [[[3.0, bound], *[[-bound, bound]] * (cubes - 1)]]
    share = (bound + 3.0) / (2 * bound) if undecided else 1.0
    state = policy.state["policy"]
    found = steps_of(policy.description, state, high=3.0 if undecided else None)
    steps = {number: 0.97 * share * part for number, part in found.items()}
    outcome = {
        "end": end,
        "collected": [end == "all_cubes"] * cubes,
        "loops": False,
        "share": share,
        "steps": {"300": 0.97 * share} if end == "step_limit" else steps,
        "boxes": stated,
    }
    return certificate_of(policy, [outcome], left, 1.0 - share)
