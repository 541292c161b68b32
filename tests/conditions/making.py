"""Flights under other conditions as `shifts.json` has them, made up and not flown."""

import base64
import zlib

from drone_rl.checks import fingerprint
from drone_rl.conditions.axes import AXES
from drone_rl.conditions.suite import finite
from drone_rl.settings.shifting import ShiftSettings
from drone_rl.sim.tasks import as_task


def share(successes, trials=200):
    counts = {"successes": successes, "trials": trials}
    return {"share": successes / trials, "lower95": 0.5, "upper95": 1.0, **counts}


def figures(successes=200):
    return {"success": share(successes), "difference": {}, "paired": {}, "shares": {}} | {
        "ends": {},
        "unchanged": False,
    }


def flown():
    return {
        "refused": None,
        "oracle": share(200),
        "impossible": False,
        "modes": {"constant": figures()},
    }


def along(axis, of):
    levels = [
        {"number": i, "value": axis.value(s, of), "position": axis.position(s), **flown()}
        for i, s in enumerate(axis.strengths, 1)
    ]
    neutral = finite(axis.value(axis.neutral, of))
    about = {"group": axis.group, "unit": axis.unit, "neutral": neutral}
    return {**about, "areas": {"constant": 1.0}, "levels": levels}


def found_to(axis, of, last, impossible=False):
    """The range of an axis that is good up to one of its strengths, the next of which is not."""
    strengths = [axis.neutral, *axis.strengths]
    there = strengths[1 : strengths.index(last) + 2]
    at = [
        {"position": axis.position(s), "value": finite(axis.value(s, of)), "good": s != there[-1]}
        for s in there
    ]
    ends = sorted([(0.0, finite(axis.value(axis.neutral, of))), (axis.position(last), last)])
    failed = {"end": "high", "value": at[-1]["value"], "good": False, "bad": True, "worst": None}
    failed |= {"refused": None, "success": 0.5, "oracle": share(100), "impossible": impossible}
    limits = {"low": ends[0][1], "high": ends[1][1], "positions": [end[0] for end in ends]}
    opened = {"low_open": None, "high_open": False}
    return {**limits, **opened, "failed": [failed], "flown": at}


def shifts_of(policy, *, axes=("blur", "dead_rows"), weights=None):
    """Of a policy that is good up to the third strength of each axis."""
    of = policy.description
    camera = of.camera
    black = zlib.compress(bytes(3 * camera.width * camera.height))
    return {
        "format": "drone_rl shifts",
        "format_version": 1,
        "policy": policy.name,
        "network": {
            "weights": weights or fingerprint(policy.state["policy"]),
            "description": of.as_dict(),
        },
        "settings": ShiftSettings(seed=0).values(),
        "seed": 0,
        "seed_is_fixed": True,
        "terms": as_task(of.task).terms.as_dict(),
        "plain": {"oracle": share(200), **figures()},
        "axes": {name: along(AXES[name], of) for name in axes},
        "together": flown(),
        "domain": {
            "plain": {"good": True, "bad": False, "refused": None, "success": 1.0, "worst": None},
            "ranges": {n: found_to(AXES[n], of, AXES[n].strengths[2]) for n in axes},
        },
        "seconds": 1.0,
        "pictures": {name: [base64.b64encode(black).decode()] * 6 for name in axes},
    }
