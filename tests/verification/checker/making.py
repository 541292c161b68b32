"""Certificates without a prover: true ones of one cube by bisection, and of any boxes by hand."""

import functools
import itertools
import json

import numpy as np

import drone_rl
from benchmarks.gamed_certificates import certificate_of, steps_of
from drone_rl.policies.zoo import fingerprint
from drone_rl.sim.tasks.collect_cubes import CubesEnd
from drone_rl.verification.checker.checker import Simulator

BAND = 1e-5
"""Half-width of the undecided band at a border, metres."""


def of_one_cube(name):
    """Return a certificate of one cube, made once in a process."""
    return json.loads(_by_bisection(name))


@functools.cache
def _by_bisection(name):
    """Bisect between neighbours on a grid whose episodes end differently; return JSON."""
    policy = drone_rl.load_policy(name).in_task(num_cubes=1)
    simulator = Simulator(policy.description, policy.state.weights)
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
    return json.dumps(certificate_of(policy, *_as_outcomes(pieces, cuts)))


def _as_outcomes(pieces, cuts):
    """Return outcomes between cuts; bands around cuts between outcomes are undecided."""
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
            "end": CubesEnd(end).name.lower(),
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


_known_steps = {}


def _steps(policy, total, high):
    """See `steps_of`; episodes of the same policy and task are run once."""
    key = fingerprint(policy.state.weights), str(policy.description), total, high
    if key not in _known_steps:
        _known_steps[key] = steps_of(policy, total, high)
    return _known_steps[key]


def of_every_place(policy, end="all_cubes", undecided=False):
    """State the same end everywhere, or only where the first cube's y is below 3."""
    task = policy.task
    bound, cubes = task.lateral_bound, task.num_cubes
    stated, left = [[[-bound, bound]] * cubes], []
    if undecided:
        stated = [[[-bound, 3.0], *[[-bound, bound]] * (cubes - 1)]]
        left = [[[3.0, bound], *[[-bound, bound]] * (cubes - 1)]]
    share = (bound + 3.0) / (2 * bound) if undecided else 1.0
    steps = {} if end == "step_limit" else _steps(policy, 0.97 * share, 3.0 if undecided else None)
    outcome = {
        "end": end,
        "collected": [end == "all_cubes"] * cubes,
        "loops": False,
        "share": share,
        "steps": {"300": 0.97 * share} if end == "step_limit" else dict(steps),
        "boxes": stated,
    }
    return certificate_of(policy, [outcome], left, 1.0 - share)
