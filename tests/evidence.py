"""Small hand-written evidence in the form of the program's files, for tests of sentences.

It contains every entry that a sentence reads. Nothing was measured.
"""

import copy
from collections.abc import Mapping
from typing import Any

from drone_rl.config.commands import ShiftSettings
from drone_rl.sim.vocabulary import shipped_vocabulary

Plain = dict[str, Any]


def changed(evidence: Mapping[str, Any], changes: Mapping[str, Any]) -> Plain:
    """Return a copy of evidence with some entries replaced.

    Args:
        evidence: The original, which is not changed.
        changes: New values by path, such as "greedy.shares.left.mean" or "rows.0.share".
    """
    result: Plain = copy.deepcopy(dict(evidence))
    for path, value in changes.items():
        *parents, last = path.split(".")
        node: Any = result
        for key in parents:
            node = node[int(key) if isinstance(node, list) else key]
        node[int(last) if isinstance(node, list) else last] = copy.deepcopy(value)
    return result


def _mean(mean: float, lower: float, upper: float) -> Plain:
    return {"mean": mean, "lower95": lower, "upper95": upper, "count": 300}


def _share(successes: int, trials: int, lower: float, upper: float) -> Plain:
    counts = {"successes": successes, "trials": trials}
    return {"share": successes / trials, "lower95": lower, "upper95": upper, **counts}


def _episodes(success: float, left: float, ahead: float, right: float) -> Plain:
    every = (left + ahead + right) / 3
    shares = {"all": every, "left": left, "ahead": ahead, "right": right}
    return {
        "episodes": 400,
        "success": _share(round(400 * success), 400, success - 0.02, success + 0.02),
        "shares": {name: _mean(mean, mean - 0.02, mean + 0.02) for name, mean in shares.items()},
    }


def _row(by: str, value: str, failed: int, episodes: int) -> Plain:
    share = failed / episodes
    of = {"episodes": episodes, "failed": failed, "share": share}
    return {"by": by, "value": value, **of, "lower95": share - 0.02, "upper95": share + 0.02}


FIXED_SEED: Plain = {"seed": 0, "seed_is_fixed": True}
"""Entries of a result with a fixed seed."""

VERDICT: Plain = {
    "kind": "none of these",
    **FIXED_SEED,
    "certain": True,
    "exit_code": 12,
    "error_rate": 0.05,
    "good_share": 0.9,
    "enough": 400,
    "num_cubes": 3,
    "proof": None,
    "repetition": {
        "implementation": "fused kernel",
        "episodes": 50,
        "successes": 30,
        "runs": [{"how": "one environment at a time", "different": 0, "successes": 30}],
    },
    "camera": {
        "own": 0.6,
        "exchanged": 0.1,
        "success": _mean(0.5, 0.4, 0.6),
        "strata": {"left": _mean(0.4, 0.3, 0.5)},
    },
    "greedy": _episodes(0.6, 0.5, 1.0, 0.9),
    "sampled": _episodes(0.4, 0.4, 0.9, 0.8),
    "drawing": _mean(-0.2, -0.3, -0.1),
    "baselines": {
        "random": _episodes(0.03, 0.2, 0.4, 0.2),
        "forward": _episodes(0.02, 0.0, 1.0, 0.0),
        "left": _episodes(0.0, 0.0, 0.0, 0.0),
        "right": _episodes(0.0, 0.0, 0.0, 0.0),
        "oracle": _episodes(1.0, 1.0, 1.0, 1.0),
    },
    "failures": {
        "rows": [_row("side", "left", 150, 300), _row("end", "step_limit", 40, 400)],
        "largest": _row("side", "left", 150, 300),
        "bound": _share(160, 400, 0.35, 0.45),
    },
}
"""Content of `verdict.json` of a policy that collects half of the cubes on its left."""


PROOF: Plain = {
    "refused": None,
    "every": True,
    "share": 1.0,
    "undecided": 0.0,
    "checked": 3000,
    "wrong_at_most": 0.0013,
    "computed": False,
    "seed": 17,
    "seed_is_fixed": False,
}
"""Entries of a verdict about a certificate of success from every placement."""


def _level(number: int, value: float, position: float, successes: int, oracle: int) -> Plain:
    success = _share(successes, 200, successes / 200 - 0.05, successes / 200 + 0.05)
    return {
        "number": number,
        "value": value,
        "position": position,
        "refused": None,
        "oracle": _share(oracle, 200, oracle / 200 - 0.05, oracle / 200 + 0.05),
        "impossible": oracle < 150,
        "modes": {"constant": {"success": success, "unchanged": False}},
    }


def _along(group: str, unit: str, neutral: float, *levels: Plain) -> Plain:
    along = {"group": group, "unit": unit, "neutral": neutral}
    return {**along, "areas": {"constant": 0.75}, "levels": [*levels]}


def _found(low: float, high: float, positions: list[float], **more: Any) -> Plain:
    ends = {"low_open": None, "high_open": None, "failed": []}
    if low < high:
        ends["test"] = {"success": _share(150, 150, 0.975, 1.0), "required": 0.9}
    return {"low": low, "high": high, "positions": positions, **ends, **more}


_DARK = {
    "good": False, "bad": True, "refused": None, "success": 0.4, "value": 0.8,
    "worst": {"side": "right", "share": 0.47}, "end": "low", "impossible": False,
    "oracle": _share(400, 400, 0.99, 1.0),
}  # fmt: skip
SHIFTS: Plain = {
    "policy": "made up",
    "network": None,
    "terms": shipped_vocabulary("collect_cubes").as_dict(),
    **FIXED_SEED,
    "settings": ShiftSettings(domain_episodes=400, episodes=200, seed=0).values(),
    "plain": {"success": _share(200, 200, 0.98, 1.0), "oracle": _share(200, 200, 0.98, 1.0)},
    "axes": {
        "sun": _along(
            "light", "degrees", 55.0, _level(1, 60, 5, 199, 200), _level(5, 0, -55, 20, 90)
        ),
        "blur": _along(
            "sensor", "pixels", 0.0, _level(1, 0.5, 0.5, 200, 200), _level(5, 2, 2, 190, 200)
        ),
        "brightness": _along("light", "times", 1.0, _level(1, 0.8, -0.2, 80, 200)),
    },
    "together": _level(3, 0.0, 0.0, 3, 180),
    "domain": {
        "plain": {"good": True},
        "ranges": {
            "sun": _found(21.07, 60.0, [-33.93, 5.0], low_open=False, high_open=True, low_bad=9.0),
            "blur": _found(0.0, 1.5, [0.0, 1.5], high_open=False),
            "brightness": _found(1.0, 1.0, [0.0, 0.0], low_open=False, failed=[_DARK]),
        },
    },
}
SAVED_SHIFTS: Plain = {"path": "shifts.json", "dated": "2026-01-31 12:00", "shifts": SHIFTS}
"""The same, as it is quoted."""
