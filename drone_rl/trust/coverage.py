"""Find a policy's operating domain, compare it with a required one, and re-run a sample of it."""

import dataclasses
from collections.abc import Iterator, Mapping
from contextlib import closing, suppress
from pathlib import Path
from typing import Any

import numpy as np

from drone_rl.config.commands import JudgeSettings, ShiftSettings
from drone_rl.policies.policy import BasePolicy, Policy
from drone_rl.policies.zoo import shifts_path
from drone_rl.trust.agents import OracleAgent
from drone_rl.trust.axes import AXES, Axis, find_axes
from drone_rl.trust.domain import Prober
from drone_rl.trust.paired_evaluation import EvaluatedPolicy, PairedEvaluator
from drone_rl.trust.perturbations import Condition
from drone_rl.trust.shifts_file import SavedShifts, read_shifts
from drone_rl.trust.shifts_text import contradicted, lacking, needed_range
from drone_rl.utils.display import Result
from drone_rl.utils.errors import InputError
from drone_rl.utils.files import as_path, parse_json, read_bytes
from drone_rl.utils.limits import YAML_BYTES
from drone_rl.utils.readers import parse_yaml
from drone_rl.utils.schema import Maybe, OneOf, Real, Record, as_mapping
from drone_rl.utils.seeding import RootSeed

NUM_RANDOM_STRENGTHS = 2
"""Number of random strengths within each range, in addition to its ends."""
MAX_FILES = 100
"""Largest number of files of `drone-rl shifts` to read."""
Need = Mapping[str, float | None]
"""Required range of an axis: "low" and "high"; None stands for the value without perturbation."""
_LIMIT = Maybe(Real(-1e9, 1e9))
_SIGNED = frozenset({"sun"})
"""Axes with values below 0."""


@dataclasses.dataclass(frozen=True)
class DomainRecheck(Result):
    """New episodes under required conditions, compared with a file."""

    episodes: int
    """At each strength."""
    seed: int
    """Of the episodes and of the random strengths."""
    seed_is_fixed: bool
    """Whether it was chosen, so that a policy could have been fitted to it."""
    strengths: Mapping[str, tuple[float, ...]]
    """Values that were run, by axis."""
    contradictions: tuple[str, ...]
    """What contradicts the file, one line each."""

    @property
    def count(self) -> int:
        """Number of strengths of all axes."""
        return sum(map(len, self.strengths.values()))

    def __str__(self) -> str:
        """Return the numbers of episodes and strengths, and the seed."""
        fitted = ", to which a policy could have been fitted" if self.seed_is_fixed else ""
        kind = "fixed" if self.seed_is_fixed else "fresh"
        return (
            f"re-checked by {self.episodes:,} episodes at each of {self.count} strengths, ends of "
            f"the ranges and random ones ({kind} seed {self.seed}{fitted})"
        )


@dataclasses.dataclass(frozen=True)
class Coverage(Result):
    """A required operating domain compared with a measured one."""

    needs: Mapping[str, Need]
    """By axis."""
    lacking: Mapping[str, str]
    """By axis that is not covered, what the operating domain lacks."""
    against: str | None = None
    """The reason why the operating domain is refused, if it is."""
    reflown: DomainRecheck | None = None
    """New episodes at a sample of the requirements, if any were run."""

    @property
    def is_stated(self) -> bool:
        """Whether the file states that the policy is good under all requirements."""
        return not self.lacking and self.against is None

    @property
    def is_covered(self) -> bool:
        """Whether it states so, and new episodes do not contradict it."""
        return self.is_stated and self.reflown is not None and not self.reflown.contradictions

    def __str__(self) -> str:
        """Return a line for each axis that is not covered, or one for all."""
        if self.is_covered:
            return f"covered: {', '.join(self.needs)}, each alone, {self.reflown}"
        lines = [*self.lacking.values(), *filter(None, [self.against])]
        if self.reflown is not None:
            lines += self.reflown.contradictions
        elif not lines:
            lines.append("the file states it, and no episodes re-checked it (domain_flights=0)")
        return "\n".join(f"not covered: {line}" for line in lines)


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
            return SavedShifts(adjacent, None, refused=str(error))
    folder = as_path(outputs, "outputs") / "shifts"
    there = [*folder.glob("runs/*/shifts.json"), *folder.glob("multiruns/*/*/shifts.json")]
    newest = None
    for path in sorted(there, key=lambda p: p.stat().st_mtime, reverse=True)[:MAX_FILES]:
        with suppress(InputError):  # of another policy
            measured = read_shifts(path, *of)
            if measured.has_ranges:
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
    kinds = {"low": _LIMIT, "high": _LIMIT, "unit": OneOf((axis.unit,))}
    try:
        need = Record(kinds, optional=frozenset(("low", "high"))).read(value, name)
        limits = [need[end] for end in ("low", "high") if need.get(end) is not None]
        if not limits or limits != sorted(limits) or (limits[0] < 0 and name not in _SIGNED):
            wanted = "numbers" if name in _SIGNED else "numbers of 0 or more"
            raise InputError(f"{name}: {limits} must be one or two rising {wanted}")
    except InputError as error:
        raise InputError(f"{error}; give low, high or both, and unit: {axis.unit}") from None
    return {"low": need.get("low"), "high": need.get("high")}


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
    if measured.numbers is None:
        raise InputError(f"require_domain={needed}, but {measured.refused}; {remedy}")
    if not measured.has_ranges:
        raise InputError(
            f"require_domain={needed}, but {measured.path} has no ranges (domain=false); {remedy}"
        )
    try:
        lacks = {name: lacking(measured.numbers, name, need) for name, need in needs.items()}
    except InputError as error:
        raise InputError(f"require_domain={needed}: {error}") from None
    return Coverage(needs, {name: line for name, line in lacks.items() if line is not None})


def recheck_domain(
    policy: BasePolicy,
    needs: Mapping[str, Need],
    numbers: Mapping[str, Any],
    settings: JudgeSettings,
    seed: RootSeed,
) -> DomainRecheck:
    """Run new episodes at the ends of the required ranges and at random strengths within them.

    `needs` are from `read_requirements`, `numbers` as in `shifts.json`; the settings have
    `domain_flights` and `good_share`. `seed` is the root of all random streams.
    """
    from drone_rl.trust.shifts import make_evaluated_policy  # slow to import: it draws charts

    how = ShiftSettings(device=settings.device, renderer=settings.renderer)
    subject, rng = make_evaluated_policy(policy, how), np.random.default_rng(seed.value)
    tried = {
        axis: [*_strengths(axis, subject, needs[axis.name], numbers, rng)]
        for axis in find_axes(needs, subject)
    }
    count = sum(map(len, tried.values())) + 1
    with closing(PairedEvaluator(subject, settings.domain_flights, seed.value)) as evaluator:
        oracle = evaluator.run(Condition(), agent=OracleAgent(only_visible=False)).episodes
        prober = Prober(evaluator, oracle, settings.good_share, plain_part=1 / count)
        contradictions = [contradicted(None, 0.0, "", prober.plain)]
        for axis, strengths in tried.items():
            for strength in strengths:
                probed = prober.probe(axis.make(strength, subject), 1 / count)
                value = axis.value(strength, subject)
                contradictions.append(contradicted(axis.name, value, axis.unit, probed))
    return DomainRecheck(
        episodes=settings.domain_flights,
        seed=seed.value,
        seed_is_fixed=seed.is_fixed,
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
    numbers: Mapping[str, Any],
    rng: np.random.Generator,
) -> Iterator[float]:
    """The ends other than no perturbation, and random strengths between them, each once."""
    low, high = needed_range(axis.name, numbers["axes"][axis.name], need)
    ends = sorted(axis.position(axis.strength(value, subject)) for value in (low, high))
    sampled = rng.uniform(ends[0], ends[1], NUM_RANDOM_STRENGTHS) if ends[0] < ends[1] else []
    seen: set[float] = set()
    for position in (*ends, *(float(one) for one in sampled)):
        strength = axis.at(position)
        strength = float(round(strength)) if axis.whole else strength
        if abs(axis.position(strength)) > 1e-12 and strength not in seen:
            seen.add(strength)
            yield strength
