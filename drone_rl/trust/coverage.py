"""Find the recorded operating domain of a policy, and test whether it is good in a required one."""

from contextlib import closing, suppress
from pathlib import Path
from typing import Any

from drone_rl.config.commands import JudgeSettings
from drone_rl.policies.policy import BasePolicy, Policy
from drone_rl.policies.zoo import shifts_path
from drone_rl.trust.axes import AXES, Axis, find_axes
from drone_rl.trust.axes_table import NAMES
from drone_rl.trust.domain import Span, required_success, run_across
from drone_rl.trust.paired_evaluation import EvaluatedPolicy, PairedEvaluator
from drone_rl.trust.shifts_file import read_shifts
from drone_rl.trust.shifts_results import Coverage, Need, SavedShifts
from drone_rl.utils.errors import InputError
from drone_rl.utils.files import as_path, newest_first, parse_json, read_bytes
from drone_rl.utils.limits import YAML_BYTES
from drone_rl.utils.readers import parse_yaml
from drone_rl.utils.schema import OneOf, as_mapping
from drone_rl.utils.seeding import RootSeed

MAX_FILES = 100
"""Largest number of files of `drone-rl shifts` to read."""
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
    of = policy.description, policy.state.weights
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
    for path in newest_first(there)[:MAX_FILES]:
        with suppress(InputError):  # of another policy
            measured = read_shifts(path, *of)
            if measured.shifts and measured.shifts.ranges:
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


def check_required(
    policy: BasePolicy, needed: str | Path, settings: JudgeSettings, seed: RootSeed
) -> Coverage:
    """Run new episodes at strengths drawn from all required ranges together, one each.

    Args:
        policy: The policy, of any origin.
        needed: File of the requirements, see `read_requirements`.
        settings: They have `domain_flights` and `good_share`.
        seed: Root of all random streams.

    Raises:
        InputError: The file is unusable, or an axis or a range in it is not for the policy's task.
    """
    needs = read_requirements(as_path(needed, "require_domain"))
    subject = EvaluatedPolicy.of(policy, device=settings.device, renderer=settings.renderer)
    try:
        axes = find_axes(needs, subject)
        spans = {axis: required_span(axis, needs[axis.name], subject) for axis in axes}
    except InputError as error:
        raise InputError(f"require_domain={needed}: {error}") from None
    coverage, episodes = Coverage(needs=needs, **seed.as_dict()), settings.domain_flights
    if not episodes:
        return coverage
    with closing(PairedEvaluator(subject, episodes, seed.value)) as evaluator:
        oracle = evaluator.run_oracle()
    required = required_success(oracle, settings.good_share)
    return coverage.replace(test=run_across(subject, spans, episodes, seed.value, required))


def required_span(axis: Axis, need: Need, subject: EvaluatedPolicy) -> Span:
    """Return the positions of a required range on an axis, lower first.

    A missing end is the value without perturbation; an `InputError` is raised if that is beyond.
    """
    neutral = axis.value(axis.neutral, subject)
    low, high = (neutral if end is None else end for end in (need.low, need.high))
    if low > high:
        missing, other, limit = ("low", "high", high) if need.low is None else ("high", "low", low)
        raise InputError(
            f"{NAMES[axis.name]}: {missing} is missing and therefore {neutral:.4g} {axis.unit}, "
            f"the value without perturbation, but {other} is {limit:.4g}; give {missing}, too"
        )
    first, last = sorted(axis.position(axis.strength(value, subject)) for value in (low, high))
    return first, last
