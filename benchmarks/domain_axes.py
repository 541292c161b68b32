"""Enforcement of required operating domains on every axis, from the file to the verdict."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from benchmarks.benchmark import Setup
from drone_rl.config.commands import JudgeSettings
from drone_rl.policies.policy import load_policy
from drone_rl.trust.axes import AXES
from drone_rl.trust.coverage import check_required
from drone_rl.trust.shifts import shifts
from drone_rl.trust.shifts_results import Robustness
from drone_rl.utils.progress import silent
from drone_rl.utils.seeding import root_seed

POLICY = "robust"
"""A policy that is good in a range of positive width on every axis."""


def bench_domain_axes(setup: Setup) -> dict[str, Any]:
    """Search the operating domain of a policy, and require its ranges and values beyond them.

    Returns:
        "domain_axes": number of axes; "domain_axes_right": number of axes on which the range that
        was found is accepted, and values at which the policy is certainly not good are refused;
        "domain_axes_wrong": problems of the other axes, by name.
    """
    folder = setup.runs / "domain_axes"
    folder.mkdir(parents=True, exist_ok=True)
    result = shifts(
        load_policy(POLICY),
        axes=["fog", "sun"] if setup.quick else None,
        strengths=[5],
        modes=["constant"],
        episodes=20 if setup.quick else 50,
        domain_episodes=200 if setup.quick else 600,
        progress=silent,
    )
    wrong = {name: [*_problems(result, name, folder / "needs.json")] for name in result.axes}
    return {
        "domain_axes": len(wrong),
        "domain_axes_right": sum(not problems for problems in wrong.values()),
        "domain_axes_wrong": {name: problems for name, problems in wrong.items() if problems},
    }


def _problems(result: Robustness, name: str, path: Path) -> Iterator[str]:
    """Yield what is wrongly accepted or refused on an axis; `path` is of a temporary file."""

    def is_covered(need: dict[str, Any]) -> bool:
        path.write_text(json.dumps({name: need}))
        seed = root_seed(None)
        return check_required(load_policy(POLICY), path, JudgeSettings(), seed).is_covered

    if (found := result.requirements().get(name)) and not is_covered(found):
        yield "the range that was found is refused"
    for bad in (result.ranges[name].low_bad, result.ranges[name].high_bad):
        if bad is not None and is_covered({"low": bad, "high": bad, "unit": AXES[name].unit}):
            yield f"{bad:g} is accepted"
