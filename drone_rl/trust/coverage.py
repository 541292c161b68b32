"""Find a policy's operating domain, compare it with a required one, and re-run a sample of it."""

import math
from collections.abc import Iterator, Mapping
from contextlib import closing, suppress
from pathlib import Path
from typing import Any

import numpy as np

from drone_rl.config.commands import JudgeSettings, ShiftSettings
from drone_rl.policies.baselines import OracleAgent
from drone_rl.policies.policy import BasePolicy, Policy
from drone_rl.policies.zoo import shifts_path
from drone_rl.trust.axes import AXES, Axis, find_axes
from drone_rl.trust.axes_table import NAMES
from drone_rl.trust.domain import Prober
from drone_rl.trust.paired_evaluation import EvaluatedPolicy, PairedEvaluator
from drone_rl.trust.perturbations import Condition
from drone_rl.trust.shifts_file import read_shifts
from drone_rl.trust.shifts_results import (
    AlongAxis,
    Coverage,
    DomainRecheck,
    Need,
    Probe,
    Robustness,
    SavedShifts,
)
from drone_rl.utils.errors import InputError
from drone_rl.utils.files import as_path, parse_json, read_bytes
from drone_rl.utils.limits import YAML_BYTES
from drone_rl.utils.readers import parse_yaml
from drone_rl.utils.schema import OneOf, as_mapping
from drone_rl.utils.seeding import RootSeed
from drone_rl.utils.text import percent

NUM_RANDOM_STRENGTHS = 2
"""Number of random strengths within each range, in addition to its ends."""
MAX_FILES = 100
"""Largest number of files of `drone-rl shifts` to read."""
NEARLY = 1e-9
"""Relative rounding of a limit."""
_SIGNED = frozenset({"sun"})
"""Axes with values below 0."""


def find_domain(
    policy: BasePolicy, shifts: str | Path | None = None, outputs: str | Path = "outputs"
) -> SavedShifts | None:
    """Find the robustness evaluation of a policy in its task; return None if there is none.

    It is the given file or the shifts.json of the given folder, by default the file next to the
    policy (`drone_rl.policies.zoo.shifts_path`), otherwise the newest one below `outputs` that
    `drone-rl shifts` wrote for it, preferably one with ranges. An invalid file next to the policy
    is returned as refused.

    Raises:
        InputError: The given file is unreadable, of another network or task, or contradicts itself.
    """
    if not isinstance(policy, Policy):
        if shifts is not None:
            raise InputError(
                f"policy={policy.name} is not a drone_rl policy file, so shifts={shifts} can't be "
                "matched to its weights; leave shifts out"
            )
        return None
    of = policy.description, policy.state["policy"]
    if shifts is not None:
        path = as_path(shifts, "shifts")
        return read_shifts(path / "shifts.json" if path.is_dir() else path, *of)
    adjacent = shifts_path(policy.path)
    if adjacent.is_file():
        try:
            return read_shifts(adjacent, *of)
        except InputError as error:
            return SavedShifts(path=str(adjacent), refused=str(error))
    folder = as_path(outputs, "outputs") / "shifts"
    there = [*folder.glob("runs/*/shifts.json"), *folder.glob("multiruns/*/*/shifts.json")]
    newest = None
    for path in sorted(there, key=lambda p: p.stat().st_mtime, reverse=True)[:MAX_FILES]:
        with suppress(InputError):  # of another policy
            measured = read_shifts(path, *of)
            if measured.ranges:
                return measured
            newest = newest or measured
    return newest


def read_requirements(path: Path) -> dict[str, Need]:
    """Read requirements from a YAML or JSON file.

    The file has for each axis `{low: 40, high: 100, unit: m of sight}`; one end may be missing.

    Raises:
        InputError: The file is missing or damaged, or an axis, unit or range in it is wrong.
    """
    parse = parse_json if path.suffix == ".json" else parse_yaml
    try:
        required = as_mapping(parse(read_bytes(path, YAML_BYTES), "the file"), "the file")
        if not required:
            raise InputError(
                "the file is empty; give axes, as in {fog: {low: 60, unit: m of sight}}"
            )
        return {name: _read_need(name, need) for name, need in required.items()}
    except InputError as error:
        raise InputError(f"require_domain={path}: {error}") from None


def _read_need(name: str, value: Any) -> Need:
    axis = AXES[OneOf(tuple(AXES)).read(name, "axis")]
    try:
        need = Need.read(value, name)
        limits = [limit for limit in (need.low, need.high) if limit is not None]
        if need.unit != axis.unit:
            raise InputError(f"{name}.unit={need.unit} must be {axis.unit}")
        if not limits or limits != sorted(limits) or (limits[0] < 0 and name not in _SIGNED):
            wanted = "numbers" if name in _SIGNED else "numbers of 0 or more"
            raise InputError(f"{name}: {limits} must be one or two rising {wanted}")
    except InputError as error:
        raise InputError(f"{error}; give low, high or both, and unit: {axis.unit}") from None
    return need


def compare_with_required(
    policy: BasePolicy, needed: str | Path, measured: SavedShifts | None
) -> Coverage:
    """Compare the requirements in a file with a policy's operating domain.

    See `read_requirements` and `find_domain`.

    Raises:
        InputError: The file is unusable, the policy is no policy file, or its operating domain was
            not measured or is refused.
    """
    needs = read_requirements(as_path(needed, "require_domain"))
    if not isinstance(policy, Policy):
        raise InputError(
            f"policy={policy.name} is not a drone_rl policy file, so no shifts.json can be matched "
            f"to its weights; leave require_domain={needed} out"
        )
    remedy = f"run drone-rl shifts policy={policy.path} first, in the same task"
    if measured is None:
        raise InputError(f"require_domain={needed}, but the policy has no shifts.json; {remedy}")
    if measured.shifts is None:
        raise InputError(f"require_domain={needed}, but {measured.refused}; {remedy}")
    if not measured.ranges:
        raise InputError(
            f"require_domain={needed}, but {measured.path} has no ranges (domain=false); {remedy}"
        )
    try:
        lacks = {name: lacking(measured.shifts, name, need) for name, need in needs.items()}
    except InputError as error:
        raise InputError(f"require_domain={needed}: {error}") from None
    found = {name: line for name, line in lacks.items() if line is not None}
    return Coverage(needs=needs, lacking=found)


def recheck_domain(
    policy: BasePolicy,
    needs: Mapping[str, Need],
    measured: Robustness,
    settings: JudgeSettings,
    seed: RootSeed,
) -> DomainRecheck:
    """Run new episodes at the ends of the required ranges and at random strengths within them.

    `needs` are from `read_requirements`; the settings have
    `domain_flights` and `good_share`. `seed` is the root of all random streams.
    """
    from drone_rl.trust.shifts import make_evaluated_policy  # slow to import: it draws charts

    how = ShiftSettings(device=settings.device, renderer=settings.renderer)
    subject, rng = make_evaluated_policy(policy, how), np.random.default_rng(seed.value)
    tried = {
        axis: [*_strengths(axis, subject, needs[axis.name], measured, rng)]
        for axis in find_axes(needs, subject)
    }
    count = sum(map(len, tried.values())) + 1
    with closing(PairedEvaluator(subject, settings.domain_flights, seed.value)) as evaluator:
        oracle = evaluator.run(Condition(), agent=OracleAgent()).episodes
        prober = Prober(evaluator, oracle, settings.good_share, plain_part=1 / count)
        contradictions = [contradicted(None, 0.0, "", prober.plain)]
        for axis, strengths in tried.items():
            for strength in strengths:
                probed = prober.probe(axis.make(strength, subject), 1 / count)
                value = axis.value(strength, subject)
                contradictions.append(contradicted(axis.name, value, axis.unit, probed))
    return DomainRecheck(
        episodes=settings.domain_flights,
        **seed.as_dict(),
        strengths={
            axis.name: tuple(axis.value(strength, subject) for strength in strengths)
            for axis, strengths in tried.items()
        },
        contradictions=tuple(line for line in contradictions if line is not None),
    )


def _strengths(
    axis: Axis,
    subject: EvaluatedPolicy,
    need: Need,
    measured: Robustness,
    rng: np.random.Generator,
) -> Iterator[float]:
    """The ends other than no perturbation, and random strengths between them, each once."""
    low, high = needed_range(axis.name, measured.axes[axis.name], need)
    ends = sorted(axis.position(axis.strength(value, subject)) for value in (low, high))
    sampled = rng.uniform(ends[0], ends[1], NUM_RANDOM_STRENGTHS) if ends[0] < ends[1] else []
    seen: set[float] = set()
    for position in (*ends, *(float(one) for one in sampled)):
        strength = axis.at(position)
        strength = float(round(strength)) if axis.whole else strength
        if abs(axis.position(strength)) > 1e-12 and strength not in seen:
            seen.add(strength)
            yield strength


def needed_range(name: str, along: AlongAxis, need: Need) -> tuple[float, float]:
    """Return the ends of a required range on an axis.

    None stands for the value without perturbation; an `InputError` is raised if that is beyond.
    """
    neutral = _finite(along.neutral)
    low = neutral if need.low is None else need.low
    high = neutral if need.high is None else need.high
    if low <= high:
        return low, high
    missing, other, limit = ("low", "high", high) if need.low is None else ("high", "low", low)
    raise InputError(
        f"{NAMES[name]}: {missing} is missing and therefore {neutral:.4g} {along.unit}, the value "
        f"without perturbation, but {other} is {limit:.4g}; give {missing}, too"
    )


def contradicted(name: str | None, value: float, unit: str, probe: Probe) -> str | None:
    """Return how new episodes contradict a file, or None if they do not.

    They are at a value of an axis, None without perturbation.
    """
    if not probe.bad:
        return None
    where = "without perturbation" if name is None else f"{NAMES[name]} at {value:.4g} {unit}"
    if probe.refused is not None:
        return f"{where}: the task does not allow it ({probe.refused})"
    return (
        f"{where}: {percent(probe.success or 0.0)} of new episodes succeed, so the policy is "
        "certainly not good there; the file states that it is"
    )


def lacking(shifts: Robustness, name: str, need: Need) -> str | None:
    """Return what an operating domain lacks of a required range of an axis, or None."""
    found, along = shifts.ranges.get(name), shifts.axes.get(name)
    if found is None or along is None:
        return f"{NAMES[name]}: not evaluated; run drone-rl shifts with axes=[{name}] among others"
    low, high = needed_range(name, along, need)
    needed = f"{NAMES[name]}: needed {_span(low, high, along.unit)}"
    if found.positions is None:
        return f"{needed}; it is not certainly good even without perturbation"
    if not along.is_tested:
        return f"{needed}; not tested: {shifts.untested[NAMES[name]]}"
    good = _finite(found.low), _finite(found.high)
    short = {
        "low": good[0] > low + NEARLY * abs(low),
        "high": math.isfinite(good[1]) and good[1] < high - NEARLY * abs(high),
    }
    if not any(short.values()):
        return None
    is_lost = any(end.impossible and short[end.end] for end in found.failed)
    more = "; more is impossible even for the oracle" if is_lost else ""
    is_clear = math.isinf(good[0])  # only air without fog has an infinite lower limit
    where = f"only without {NAMES[name]}" if is_clear else _span(*good, along.unit)
    return f"{needed}, good {where}{more}"


def _finite(value: float | None) -> float:
    return math.inf if value is None else value


def _span(low: float, high: float, unit: str) -> str:
    ends = f"{low:.4g} and more" if math.isinf(high) else f"{low:.4g} to {high:.4g}"
    return f"{ends} {unit}"
