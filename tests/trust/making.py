"""Flights under other conditions as `shifts.json` has them, made up and not flown."""

import base64
import dataclasses
import zlib

from drone_rl.config.commands import ShiftSettings
from drone_rl.policies.zoo import fingerprint
from drone_rl.sim.tasks import as_task
from drone_rl.trust.axes import AXES
from drone_rl.trust.domain import walk
from drone_rl.trust.perturbations import PerturbationMode
from drone_rl.trust.suite import finite, success_area
from drone_rl.utils.intervals import mean_bounds, proportion

EPISODES = 200


def share(successes, trials=EPISODES):
    return proportion(successes, trials)


def figures(successes=EPISODES):
    """Of a policy that always succeeds where nothing is different."""
    lost = EPISODES - successes
    values = [1.0] * successes + [0.0] * lost
    return {
        "success": share(successes),
        "difference": mean_bounds([value - 1.0 for value in values], -1.0, 1.0),
        "shares": {name: mean_bounds(values) for name in ("all", "left", "ahead", "right")},
        "ends": {"all_cubes": successes, "front_boundary": lost},
        "unchanged": False,
    }


def flown(successes=EPISODES):
    return {
        "refused": None,
        "oracle": share(EPISODES),
        "impossible": False,
        "modes": {"constant": figures(successes)},
    }


def along(axis, of, last=None):
    """An axis's table: success up to one of its strengths, none after it."""
    limit = float("inf") if last is None else abs(axis.position(last)) + 1e-12
    levels = [
        {"number": i, "value": axis.value(s, of), "position": axis.position(s)}
        | flown(EPISODES if abs(axis.position(s)) <= limit else 20)
        for i, s in enumerate(axis.strengths, 1)
    ]
    neutral = finite(axis.value(axis.neutral, of))
    about = {"group": axis.group, "unit": axis.unit, "neutral": neutral}
    area = success_area(levels, 1.0, PerturbationMode.CONSTANT)
    return {**about, "areas": {"constant": area}, "levels": levels}


def found_to(axis, of, last, impossible=False):
    """The range of an axis that is good as far as one of its strengths, and no farther."""
    limit = abs(axis.position(last))
    ends = {
        end: walk(axis, sign, 0, lambda s, _: abs(axis.position(s)) <= limit + 1e-12)
        for end, sign in axis.signs.items()
    }

    def value(strength):
        return finite(axis.value(strength, of))

    every = sorted(
        (axis.position(s), value(s), good) for e in ends.values() for s, good in e.tested
    )
    about = {"good": False, "bad": True, "worst": None, "refused": None, "success": 0.5}
    about["fragile"] = 0
    about |= {"oracle": share(100 if impossible else 400, 400), "impossible": impossible}
    return {
        **{end: value(walked.limit) for end, walked in ends.items()},
        **{f"{e}_open": w.failed is None if w.tested else None for e, w in ends.items()},
        "positions": sorted(axis.position(walked.limit) for walked in ends.values()),
        "failed": [
            {"end": end, "value": value(walked.failed), **about}
            for end, walked in ends.items()
            if walked.failed is not None
        ],
        "flown": [{"position": p, "value": v, "good": good} for p, v, good in every],
    }


def owned(name, of):
    """An axis with the policy's own neutral strength."""
    axis = AXES[name]
    return axis if axis.own is None else dataclasses.replace(axis, neutral=axis.own(of))


def shifts_of(policy, *, axes=("blur", "dead_rows"), weights=None):
    """Of a policy that is good up to the third strength of each axis."""
    of = policy.description
    camera = of.camera
    black = zlib.compress(bytes(3 * camera.width * camera.height))
    return {
        "format": "drone_rl shifts",
        "format_version": 2,
        "policy": policy.name,
        "network": {
            "weights": weights or fingerprint(policy.state["policy"]),
            "description": of.as_dict(),
        },
        "settings": ShiftSettings(seed=0).values(),
        "seed": 0,
        "seed_is_fixed": True,
        "terms": as_task(of.task).vocabulary.as_dict(),
        "plain": {"oracle": share(200), **figures()},
        "axes": {name: along(owned(name, of), of, AXES[name].strengths[2]) for name in axes},
        "together": flown(),
        "domain": {
            "plain": {
                "good": True,
                "bad": False,
                "refused": None,
                "success": 1.0,
                "fragile": 0,
                "worst": None,
            },
            "ranges": {n: found_to(owned(n, of), of, AXES[n].strengths[2]) for n in axes},
        },
        "seconds": 1.0,
        "pictures": {name: [base64.b64encode(black).decode()] * 6 for name in axes},
    }
