"""Which flights under other conditions a verdict, a card or a report may quote of a policy."""

import dataclasses
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from drone_rl.policies.base_policy import Pilot
from drone_rl.policies.policy import Policy
from drone_rl.policies.zoo import shifts_path
from drone_rl.robustness.domain_text import QUOTED, lacking, why_not
from drone_rl.robustness.measured import Measured, read_measured
from drone_rl.robustness.needs import Need, read_needs
from drone_rl.utils.errors import InputError
from drone_rl.utils.text import say
from drone_rl.verdicts.domain_check import Reflown

MOST_LOOKED_AT = 100
"""Results of `drone-rl shifts`, the newest ones."""


@dataclasses.dataclass(frozen=True)
class Coverage:
    """What is needed beside what was found."""

    needs: Mapping[str, Need]
    """By axis."""
    lacking: Mapping[str, str]
    """By axis, what the operating domain lacks of it; nothing if all that is needed is covered."""
    against: str | None = None
    """Why the operating domain is not believed; None if nothing speaks against it."""
    reflown: Reflown | None = None
    """New episodes at a sample of what is needed; None if none were flown."""

    @property
    def is_stated(self) -> bool:
        """Whether the file says that it is good under all that is needed."""
        return not self.lacking and self.against is None

    @property
    def is_covered(self) -> bool:
        """Whether it says so, and new episodes were flown that do not contradict it."""
        return self.is_stated and self.reflown is not None and not self.reflown.contradictions

    def as_dict(self) -> dict[str, Any]:
        """Plain values."""
        return dataclasses.asdict(self)

    def __str__(self) -> str:
        """A line for each axis that is not covered, or one for all."""
        if self.is_covered:
            return f"covered: {', '.join(self.needs)}, each by itself, {self.reflown}"
        lines = [*self.lacking.values(), *filter(None, [self.against])]
        if self.reflown is not None:
            lines += self.reflown.contradictions
        elif not lines:
            lines.append(
                "the file says so, and no episode was flown to check it (domain_flights=0)"
            )
        return "\n".join(f"not covered: {line}" for line in lines)


def find_domain(
    policy: Pilot, given: str | Path | None = None, outputs: str | Path = "outputs"
) -> Measured | None:
    """A policy's flights under other conditions, in its task.

    Args:
        policy: Which, in the task that counts.
        given: Their file, or a folder that holds a shifts.json; by default what lies with the
            policy (`drone_rl.policies.zoo.shifts_path`), else the newest file that
            `drone-rl shifts` wrote for it, preferably one with ranges.
        outputs: Folder under which commands leave what they make.

    Returns:
        None if there are none. What lies with the policy and can't be believed is refused.

    Raises:
        InputError: What is given can't be read, is of another network or task, or contradicts
            itself.
    """
    if not isinstance(policy, Policy):
        if given is not None:
            raise InputError(
                f"shifts={given}, but policy={policy.name} was made elsewhere, and is known by no "
                "hash; leave shifts out"
            )
        return None
    if given is not None:
        path = Path(given)
        return _read(path / "shifts.json" if path.is_dir() else path, policy)
    beside = shifts_path(policy.path)
    if beside.is_file():
        try:
            return _read(beside, policy)
        except InputError as error:
            return Measured(beside, None, refused=str(error))
    found = None
    for measured in _made(policy, Path(outputs)):
        if measured.has_ranges:
            return measured
        found = found or measured
    return found


def require(policy: Pilot, needed: str | Path, measured: Measured | None) -> Coverage:
    """Compares what is needed with a policy's operating domain.

    Args:
        policy: Which.
        needed: A file, see `drone_rl.robustness.needs.read_needs`.
        measured: From `find_domain`.

    Raises:
        InputError: The file is unusable, or no operating domain was measured, or it is refused.
    """
    needs = read_needs(Path(needed))
    remedy = f"run drone-rl shifts policy={_given(policy)} first, in the same task"
    if measured is None:
        raise InputError(f"require_domain={needed}, but no domain of it was measured; {remedy}")
    if measured.numbers is None:
        raise InputError(f"require_domain={needed}, but {measured.refused}; {remedy}")
    if not measured.has_ranges:
        raise InputError(
            f"require_domain={needed}, but {measured.path} has no ranges (domain=false); {remedy}"
        )
    lacks = {name: lacking(measured.numbers, name, need) for name, need in needs.items()}
    return Coverage(needs, {name: line for name, line in lacks.items() if line is not None})


def beside(coverage: Coverage, evidence: Mapping[str, Any]) -> Coverage:
    """The same with what a verdict says against it.

    Args:
        coverage: From `require`.
        evidence: "shifts" and "verdict", see `drone_rl.robustness.domain_text`.
    """
    return dataclasses.replace(coverage, against=why_not(evidence))


def sentence(evidence: Mapping[str, Any]) -> str:
    """What may be quoted, for a person."""
    return say(QUOTED, evidence)


def _given(policy: Pilot) -> str:
    return str(policy.path) if isinstance(policy, Policy) else policy.name


def _read(path: Path, policy: Policy) -> Measured:
    return read_measured(path, policy.description, policy.state["policy"])


def _made(policy: Policy, outputs: Path) -> Iterator[Measured]:
    """What `drone-rl shifts` left of this network and task, the newest first."""
    there = [
        *outputs.glob("shifts/runs/*/shifts.json"),
        *outputs.glob("shifts/multiruns/*/*/shifts.json"),
    ]
    for path in sorted(there, key=lambda p: p.stat().st_mtime, reverse=True)[:MOST_LOOKED_AT]:
        try:
            yield _read(path, policy)
        except InputError:
            continue  # of another one
