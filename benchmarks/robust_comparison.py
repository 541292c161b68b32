"""Compare policies under the same conditions, by axis and by kinds of shift new to a training.

A training is exposed to an axis if one of the settings that `TOUCHED_BY` names differs from its
default, and to a kind of shift if it is exposed to one of its axes.
"""

from collections.abc import Iterable, Mapping, Sequence

from drone_rl.config.training import TrainSettings
from drone_rl.envs.rollout import Agent
from drone_rl.policies import greedy_agent
from drone_rl.trust.axes import AXES, GROUPS, Axis
from drone_rl.trust.paired_evaluation import EvaluatedPolicy, PairedEvaluator
from drone_rl.trust.perturbations import Condition

_PARTS = ("task", "appearance", "camera", "transforms")
"""Settings of a training that affect observations and dynamics."""


def _below(part: str, *names: str) -> tuple[str, ...]:
    return tuple(f"{part}.{name}" for name in names)


_OBJECTS = (
    *_below("appearance", "object_color", "object_texture", "object_tile"),
    *_below("task", "cube_color", "pillar_color"),
)
_LIGHT = _below("appearance", "sun_strength", "sun_color", "ambient_strength")
_TURNED = ("transforms.shift", "appearance.camera_turn")
"""Shifting the image approximates a rotation of the camera."""
_MOVED = ("appearance.camera_offset",)
_DISTRACTORS = _below(
    *("appearance", "distractors", "distractor_size", "distractor_color", "distractor_distance")
)
_SIZES = ("cube_size", "width")
TOUCHED_BY: dict[str, tuple[str, ...]] = {
    "object_color": _OBJECTS,
    "object_white": _OBJECTS,
    "floor_color": _below("appearance", "ground_color", "ground_texture", "ground_tile"),
    "camera_yaw": _TURNED,
    "camera_pitch": _TURNED,
    "camera_roll": ("appearance.camera_turn",),
    "camera_height": _MOVED,
    "camera_sideways": _MOVED,
    "field_of_view": ("camera.horizontal_fov", "appearance.camera_widening"),
    "sun": (*_LIGHT, *_below("appearance", "sun_elevation", "sun_azimuth", "shadows")),
    "brightness": ("appearance.exposure", "transforms.bias", *_LIGHT),
    "fog": _below("appearance", "fog_visibility", "sky_horizon", "sky_zenith"),
    "object_size": _below("task", *_SIZES),
    "distractors": _DISTRACTORS,
    "noise": ("transforms.noise",),
    "slow_noise": ("transforms.noise",),
    "blur": ("transforms.blur",),
    "dead_rows": ("transforms.dead_rows",),
    "frozen_frames": ("transforms.frozen_frames", "transforms.held_frames"),
    "late_frames": ("transforms.late_frames",),
    "step_length": ("task.step_length",),
    "action_delay": ("transforms.late_frames",),
}
"""By axis, the settings that expose a training to it if they differ from their defaults."""


def changed(settings: TrainSettings) -> set[str]:
    """Return settings of appearance, transforms, camera and task that differ from the default.

    Returns:
        Names such as appearance.exposure; transforms without settings, as in transforms.noise.
    """
    default, config = (s.config() for s in (TrainSettings(), settings))
    return {
        f"{part}.{name}"
        for part in _PARTS
        for name in {*config[part], *default[part]}
        if config[part].get(name) != default[part].get(name)
    }


def touched_axes(settings: TrainSettings) -> list[str]:
    """Return the axes to which a training is exposed, in the order of `AXES`."""
    differs = changed(settings)
    return [axis.name for axis in AXES.values() if differs.intersection(TOUCHED_BY[axis.name])]


def untouched_kinds(settings: TrainSettings) -> list[str]:
    """Return the kinds of shift to which a training is not exposed, in the order of `GROUPS`."""
    touched = {AXES[name].group for name in touched_axes(settings)}
    return [kind for kind in GROUPS if kind not in touched]


PLAIN = "plain"
"""Name of the condition without perturbation."""


def compare(
    evaluator: PairedEvaluator,
    subjects: Mapping[str, EvaluatedPolicy],
    axes: Iterable[Axis],
    *,
    possible_share: float = 0.9,
) -> dict[str, dict[str, float]]:
    """Return the success rate of each policy along each axis.

    Args:
        evaluator: Runs all policies in the task, camera and appearance of its own policy.
        subjects: Policies by name.
        axes: Axes of perturbation.
        possible_share: Success rate of the oracle below which a strength is left out.

    Returns:
        For each policy, by axis the mean success rate over possible strengths, and by `PLAIN` that
        without perturbation. An axis without possible strengths is left out.
    """
    makers = {name: lambda s=s: greedy_agent(s.network) for name, s in subjects.items()}
    rates = {name: {PLAIN: _share(evaluator, Condition(), make())} for name, make in makers.items()}
    for axis in axes:
        conditions = [axis.make(strength, evaluator.subject) for strength in axis.strengths]
        possible = [c for c in conditions if _is_possible(evaluator, c, possible_share)]
        for name, make in makers.items():
            if possible:
                rates[name][axis.name] = mean([_share(evaluator, c, make()) for c in possible])
    return rates


def by_kind(shares: Mapping[str, float], kinds: Iterable[str]) -> dict[str, float]:
    """Return mean success rates by kind of shift; kinds without an axis are left out."""
    grouped = {kind: [s for name, s in shares.items() if _kind(name) == kind] for kind in kinds}
    return {kind: mean(values) for kind, values in grouped.items() if values}


def mean(values: Sequence[float]) -> float:
    """Return the mean of at least one value."""
    return sum(values) / len(values)


def _kind(name: str) -> str | None:
    return AXES[name].group if name in AXES else None


def _share(evaluator: PairedEvaluator, condition: Condition, agent: Agent) -> float:
    return float(evaluator.run(condition, agent=agent).episodes.success.mean())


def _is_possible(evaluator: PairedEvaluator, condition: Condition, possible_share: float) -> bool:
    seen = evaluator.rate_of_oracle(condition)
    return seen is None or seen.upper95 >= possible_share
