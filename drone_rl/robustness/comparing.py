"""Several policies under the same conditions, in the same worlds: by axis, and by kind of shift."""

from collections.abc import Callable, Iterable, Mapping, Sequence

from drone_rl.robustness.axes import AXES
from drone_rl.robustness.axis import Axis
from drone_rl.robustness.condition import Condition
from drone_rl.robustness.eyes import Eyes, PolicyEyes
from drone_rl.robustness.flying import Airfield, Subject
from drone_rl.robustness.oracle import OracleEyes
from drone_rl.utils.intervals import proportion

PLAIN = "plain"
"""What the condition is called in which nothing is different."""


def compare(
    bed: Airfield,
    subjects: Mapping[str, Subject],
    axes: Iterable[Axis],
    *,
    possible_share: float = 0.9,
    tell: Callable[[str], None] = lambda _: None,
) -> dict[str, dict[str, float]]:
    """How often each policy succeeds along each axis.

    Args:
        bed: Where all of them are flown; task, camera and look are those of its subject.
        subjects: The policies, by name.
        axes: Along which.
        possible_share: A strength at which who sees where everything is surely succeeds less often
            is impossible, and left out for all.
        tell: Called with the axis that is being flown.

    Returns:
        By policy and by axis, and `PLAIN`: the share of successful flights, over its possible
        strengths; an axis without any is left out.
    """
    makers = {
        name: lambda s=s: PolicyEyes(s.network, s.transforms, bed.episodes)
        for name, s in subjects.items()
    }
    found = {name: {PLAIN: _share(bed, Condition(), make())} for name, make in makers.items()}
    for axis in axes:
        tell(axis.name)
        conditions = [axis.make(strength, bed.subject) for strength in axis.strengths]
        possible = [c for c in conditions if _is_possible(bed, c, possible_share)]
        for name, make in makers.items():
            if possible:
                found[name][axis.name] = mean([_share(bed, c, make()) for c in possible])
    return found


def by_kind(shares: Mapping[str, float], kinds: Iterable[str]) -> dict[str, float]:
    """Means of the shares of axes, a kind of shift each.

    Args:
        shares: By axis.
        kinds: Which; those without any axis are left out.
    """
    grouped = {kind: [s for name, s in shares.items() if _kind(name) == kind] for kind in kinds}
    return {kind: mean(values) for kind, values in grouped.items() if values}


def mean(values: Sequence[float]) -> float:
    """Of one value or more."""
    return sum(values) / len(values)


def _kind(name: str) -> str | None:
    return AXES[name].group if name in AXES else None


def _share(bed: Airfield, condition: Condition, eyes: Eyes) -> float:
    return float(bed.fly(condition, eyes=eyes).episodes.success.mean())


def _is_possible(bed: Airfield, condition: Condition, possible_share: float) -> bool:
    success = bed.fly(condition, eyes=OracleEyes()).episodes.success
    return proportion(int(success.sum()), len(success))["upper95"] >= possible_share
