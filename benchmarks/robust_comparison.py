"""Which kinds of shift a training knows, as its settings say: what is not left to opinion.

Whatever of looks, pictures, camera and task is not as by default touches the axes that name it. A
kind of shift of which one axis is touched counts as touched: nothing of it is new to the policy.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from drone_rl.config.configuration import as_config
from drone_rl.config.training import TrainSettings
from drone_rl.robustness.agents import Agent, OracleAgent, PolicyAgent
from drone_rl.robustness.axes import AXES, GROUPS, Axis
from drone_rl.robustness.paired_evaluation import PairedEvaluator, PolicySpec
from drone_rl.robustness.perturbations import Condition
from drone_rl.utils.intervals import proportion

_PARTS = ("task", "appearance", "camera", "transforms")
"""Of a training's settings, those that say what is seen and how it moves."""


def changed(settings: TrainSettings) -> set[str]:
    """Settings of looks, pictures, camera and task that are not as by default.

    Args:
        settings: A training's.

    Returns:
        Names as in appearance.exposure; transforms by theirs alone, as in transforms.noise.
    """
    default, told = (as_config(s) for s in (TrainSettings(), settings))
    return {
        f"{part}.{name}"
        for part in _PARTS
        for name in {*told[part], *default[part]}
        if _of(told[part], name) != _of(default[part], name)
    }


def touched_axes(settings: TrainSettings) -> list[str]:
    """Names of the axes of which a training knows something, in the order of `AXES`."""
    differs = changed(settings)
    return [axis.name for axis in AXES.values() if differs.intersection(axis.touched_by)]


def untouched_kinds(settings: TrainSettings) -> list[str]:
    """Kinds of shift of which a training touches no axis, in the order of `GROUPS`."""
    touched = {AXES[name].group for name in touched_axes(settings)}
    return [kind for kind in GROUPS if kind not in touched]


def _of(part: Mapping[str, Any], name: str) -> Any:
    return part.get(name)


PLAIN = "plain"
"""What the condition is called in which nothing is different."""


def compare(
    bed: PairedEvaluator,
    subjects: Mapping[str, PolicySpec],
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
        name: lambda s=s: PolicyAgent(s.network, s.transforms, bed.episodes)
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


def _share(bed: PairedEvaluator, condition: Condition, eyes: Agent) -> float:
    return float(bed.fly(condition, eyes=eyes).episodes.success.mean())


def _is_possible(bed: PairedEvaluator, condition: Condition, possible_share: float) -> bool:
    success = bed.fly(condition, eyes=OracleAgent()).episodes.success
    return proportion(int(success.sum()), len(success))["upper95"] >= possible_share
