"""Enforcement of required operating domains on every axis, from the file to the verdict."""

import dataclasses
import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from benchmarks.benchmark import Setup
from drone_rl.config.commands import JudgeSettings
from drone_rl.policies.policy import Policy, load_policy
from drone_rl.trust.axes import AXES, Axis
from drone_rl.trust.coverage import Coverage, compare_with_required, find_domain, recheck_domain
from drone_rl.trust.shifts import shifts
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
    found = shifts(
        policy,
        axes=["fog", "sun"] if setup.quick else None,
        strengths=[5],
        modes=["constant"],
        episodes=20 if setup.quick else 50,
        domain_episodes=200 if setup.quick else 600,
        progress=silent,
    )
    found.save(folder)
    flights = JudgeSettings(domain_flights=20 if setup.quick else 100)
    wrong = {name: [*_problems(policy, folder, name)] for name in found.numbers["axes"]}
    needs = _required(policy, folder, folder / "domain.yaml").needs
    reflown = recheck_domain(policy, needs, found.numbers, flights, root_seed(None))
    return {
        "domain_axes": len(wrong),
        "domain_axes_right": sum(not problems for problems in wrong.values()),
        "domain_axes_wrong": {name: problems for name, problems in wrong.items() if problems},
        "domain_axes_contradicted": [*reflown.contradictions],
    }


def _problems(policy: Policy, folder: Path, name: str) -> Iterator[str]:
    """Yield what is wrongly accepted or refused on an axis."""
    own = _required(policy, folder, folder / "domain.yaml")
    if name not in own.needs or name in own.lacking:
        yield "the program's own file is refused"
    for needed, is_inside in _ranges(policy, folder, name):
        path = folder / "needs.json"
        path.write_text(json.dumps({name: needed}))
        if _required(policy, folder, path).is_stated != is_inside:
            yield f"{needed} is {'refused' if is_inside else 'accepted'}"


def _required(policy: Policy, folder: Path, needs: Path) -> Coverage:
    return compare_with_required(policy, needs, find_domain(policy, folder))


def _ranges(
    policy: Policy, folder: Path, name: str
) -> Iterator[tuple[Mapping[str, float | str], bool]]:
    """Yield ranges that end near each limit, and whether they are inside."""
    measured = find_domain(policy, folder)
    assert measured is not None and measured.numbers is not None
    found, of = measured.numbers["domain"]["ranges"][name], policy.description
    axis = AXES[name]
    if axis.own is not None:
        axis = dataclasses.replace(axis, neutral=axis.own(_as_subject(of)))
    for end, sign in axis.signs.items():
        if found["positions"] is None or found[f"{end}_open"] is None:
            continue  # this side was not measured
        limit = found["positions"][0 if sign < 0 else 1]
        for is_inside in (True, False):
            strength = _near(axis, limit, sign, is_inside)
            value = axis.value(strength, _as_subject(of))
            if abs(value) < float("inf"):
                yield {end: value, "unit": axis.unit}, is_inside


def _as_subject(of: Any) -> Any:
    """Return a description, which has the task, camera and appearance that axes need."""
    return of


def _near(axis: Axis, limit: float, sign: int, is_inside: bool) -> float:
    """Return a strength just inside or outside a limit."""
    if axis.whole:
        return axis.at(limit) if is_inside else axis.at(limit) + sign
    width = max(abs(limit), NEAR * min(abs(axis.position(s)) for s in axis.strengths))
    moved = limit - sign * NEAR * width if is_inside else limit + sign * NEAR * width
    return axis.at(moved if sign * moved > 0 else 0.0)  # 0 is no perturbation
