"""Enforcement of required operating domains on every axis, from the file to the verdict."""

import dataclasses
import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from benchmarks.benchmark import Setup
from drone_rl.config.commands import JudgeSettings
from drone_rl.policies.policy import Policy, load_policy
from drone_rl.trust.axes import AXES, Axis
from drone_rl.trust.coverage import Coverage, compare_with_required, find_domain, recheck_domain
from drone_rl.trust.shifts import shifts
from drone_rl.trust.shifts_results import Range
from drone_rl.utils.progress import silent
from drone_rl.utils.seeding import root_seed

POLICY = "robust"
"""A policy that is good in a range of positive width on every axis."""
NEAR = 1e-3
"""Relative distance from a limit at which a required range ends inside or outside."""


def bench_domain_axes(setup: Setup) -> dict[str, Any]:
    """Search the operating domain of a policy and require ranges around its limits.

    Returns:
        "domain_axes": number of axes; "domain_axes_right": number of axes on which a range just
        inside each limit is accepted, one just outside is refused, and the program's own file is
        accepted; "domain_axes_wrong": problems of the other axes, by name;
        "domain_axes_contradicted": contradictions of new episodes to the program's own file.
    """
    folder = setup.runs / "domain_axes"
    folder.mkdir(parents=True, exist_ok=True)
    policy = load_policy(POLICY)
    result = shifts(
        policy,
        axes=["fog", "sun"] if setup.quick else None,
        strengths=[5],
        modes=["constant"],
        episodes=20 if setup.quick else 50,
        domain_episodes=200 if setup.quick else 600,
        progress=silent,
    )
    result.save(folder)
    saved = find_domain(policy, folder)
    stated = compare_with_required(policy, folder / "domain.yaml", saved)
    wrong = {name: [*_problems(policy, saved, stated, name)] for name in result.axes}
    flights = JudgeSettings(domain_flights=20 if setup.quick else 100)
    recheck = recheck_domain(policy, stated.needs, result, flights, root_seed(None))
    return {
        "domain_axes": len(wrong),
        "domain_axes_right": sum(not problems for problems in wrong.values()),
        "domain_axes_wrong": {name: problems for name, problems in wrong.items() if problems},
        "domain_axes_contradicted": [*recheck.contradictions],
    }


def _problems(policy: Policy, saved: Any, stated: Coverage, name: str) -> Iterator[str]:
    """Yield what is wrongly accepted or refused on an axis."""
    if name not in stated.needs or name in stated.lacking:
        yield "the program's own file is refused"
    path = Path(saved.path).with_name("needs.json")
    for need, is_inside in _ranges(policy, saved.ranges[name], name):
        path.write_text(json.dumps({name: need}))
        if compare_with_required(policy, path, saved).is_stated != is_inside:
            yield f"{need} is {'refused' if is_inside else 'accepted'}"


def _ranges(
    policy: Policy, measured: Range, name: str
) -> Iterator[tuple[Mapping[str, float | str], bool]]:
    """Yield ranges that end near each limit, and whether they are inside."""
    camera, look = policy.description.camera, policy.appearance
    subject: Any = SimpleNamespace(task=policy.task, camera=camera, appearance=look)
    axis = AXES[name]
    if axis.own is not None:
        axis = dataclasses.replace(axis, neutral=axis.own(subject))
    for end, sign in axis.signs.items():
        if measured.positions is None or getattr(measured, f"{end}_open") is None:
            continue  # this side was not measured
        limit = measured.positions[0 if sign < 0 else 1]
        for is_inside in (True, False):
            value = axis.value(_near(axis, limit, sign, is_inside), subject)
            if abs(value) < float("inf"):
                yield {end: value, "unit": axis.unit}, is_inside


def _near(axis: Axis, limit: float, sign: int, is_inside: bool) -> float:
    """Return a strength just inside or outside a limit."""
    if axis.whole:
        return axis.at(limit) if is_inside else axis.at(limit) + sign
    width = max(abs(limit), NEAR * min(abs(axis.position(s)) for s in axis.strengths))
    moved = limit - sign * NEAR * width if is_inside else limit + sign * NEAR * width
    return axis.at(moved if sign * moved > 0 else 0.0)  # 0 is no perturbation
