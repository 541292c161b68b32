"""Axes of perturbation, each with five strengths that are the same for every policy.

`axes.toml` has names, units and strengths; the functions that apply a strength are here.

The strengths mirror published ones: colors Distracting Control Suite (Stone et al., 2021) and
DMControl Generalization Benchmark (Hansen and Wang, 2021), camera angles the former's three levels
and two below, sizes The Colosseum (Pumacay et al., 2024), correlated noise Nasvytis et al. (2024).
"""

import dataclasses
import math
from collections.abc import Callable, Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np

from drone_rl.config.appearance import MINIMAL
from drone_rl.envs.fault_models import dead_rows, frozen_frames, late_frames, noise, out_of_focus
from drone_rl.sim.rendering.appearance import SUN_DIRECTION
from drone_rl.sim.rendering.scene import SemanticClass
from drone_rl.sim.tasks import as_task
from drone_rl.trust.axes_table import TABLE
from drone_rl.trust.paired_evaluation import EvaluatedPolicy
from drone_rl.trust.perturbations import (
    Condition,
    expose,
    fog,
    mount,
    sun_at,
    task_region,
    tint,
    whiten,
)
from drone_rl.utils.errors import InputError, did_you_mean

TOGETHER = 3
"""Number of the strength at which all axes are combined."""


class Scale(NamedTuple):
    """Scale on which distances between strengths are measured."""

    forward: Callable[[float], float]
    inverse: Callable[[float], float]
    rises: bool = True
    """Whether greater values have greater positions."""


LINEAR = Scale(float, float)
FACTORS = Scale(math.log, math.exp)
"""A half is as far from 1 as 2."""
INVERSE = Scale(lambda x: 1.0 / x, lambda x: math.inf if x == 0 else 1.0 / x, rises=False)
"""An infinite strength is no perturbation."""


@dataclasses.dataclass(frozen=True)
class Axis:
    """One quantity to perturb."""

    name: str
    group: str
    """One of the ten kinds of shift."""
    unit: str
    """Unit of its values."""
    neutral: float
    """Strength of no perturbation."""
    strengths: tuple[float, ...]
    """Five, weakest first; on both sides of the neutral one if the axis has two ends."""
    make: Callable[[float, EvaluatedPolicy], Condition]
    """The condition of a strength; raises InputError if it is not for task or renderer."""
    value: Callable[[float, EvaluatedPolicy], float] = lambda strength, _: strength
    """A strength in the axis's unit; differs where strengths are relative to the policy."""
    own: Callable[[EvaluatedPolicy], float] | None = None
    """The neutral strength of a policy, if it is not the same for all."""
    scale: Scale = LINEAR
    whole: bool = False
    """Whether only whole numbers are strengths."""

    def of(self, subject: EvaluatedPolicy) -> "Axis":
        """Return the axis with the policy's own neutral strength."""
        return self if self.own is None else dataclasses.replace(self, neutral=self.own(subject))

    def position(self, strength: float) -> float:
        """Return the position of a strength on the axis's scale, relative to the neutral one."""
        return self.scale.forward(strength) - self.scale.forward(self.neutral)

    @property
    def signs(self) -> dict[str, int]:
        """By end of a range of values, "low" and "high", the sign of its position."""
        return {"low": -1, "high": 1} if self.scale.rises else {"low": 1, "high": -1}

    def strength(self, value: float, subject: EvaluatedPolicy) -> float:
        """Return the strength that has this value for a policy: the inverse of affine `value`."""
        if not math.isfinite(value):
            return value
        zero, one = (self.value(strength, subject) for strength in (0.0, 1.0))
        strength = (value - zero) / (one - zero)
        return float(round(strength)) if self.whole else strength

    def at(self, position: float) -> float:
        """Return the strength at a position, the inverse of `position`."""
        strength = self.scale.inverse(position + self.scale.forward(self.neutral))
        return float(round(strength)) if self.whole else strength

    def sample(self, low: float, high: float, rng: np.random.Generator) -> float:
        """Return the strength at a random position, uniform on the axis's scale."""
        if self.whole:
            return float(rng.integers(round(self.at(low)), round(self.at(high)) + 1))
        return self.at(rng.uniform(low, high))


CORRELATION_TIME = -1.0 / math.log(0.95)
"""Frames; consecutive frames of noise correlate by 0.95."""
_THINGS = (SemanticClass.TARGET, SemanticClass.OBSTACLE)


def _size(subject: EvaluatedPolicy) -> str:
    name = subject.task.name
    if subject.task.object_size is None:
        raise InputError(f"axes=object_size is not for task={name}; leave it out of axes")
    return subject.task.object_size


def _rendered(subject: EvaluatedPolicy, condition: Condition) -> Condition:
    if subject.renderer != "raytrace":
        raise InputError(
            f"renderer={subject.renderer} renders no fog and no exposure; give axes without fog "
            "and brightness, or renderer=raytrace"
        )
    return condition


def _cluttered(subject: EvaluatedPolicy, count: int) -> Condition:
    task_region(subject.task)
    return Condition(clutter=count)


def _middle(value: float | tuple[float, float]) -> float:
    """A value, or the mean of a range."""
    return sum(value) / 2 if isinstance(value, tuple) else value


def _file_sun(subject: EvaluatedPolicy) -> tuple[float, float, float] | None:
    """Return the direction of the first directional light of scene files; None without one."""
    scenes = getattr(as_task(subject.task), "scenes", ())
    return next((tuple(of.sun.tolist()) for of in scenes if of.sun is not None), None)


def _sun_elevation(subject: EvaluatedPolicy) -> float:
    given, sun = subject.appearance.sun_elevation, _file_sun(subject)
    if sun is None or given != MINIMAL.sun_elevation:
        return _middle(given)
    x, y, z = sun
    return math.degrees(math.atan2(-z, math.hypot(x, y)))


def _field_of_view(change: float, subject: EvaluatedPolicy) -> float:
    return subject.camera.horizontal_fov + change


def _times(setting: str, factor: float, subject: EvaluatedPolicy) -> float:
    if not hasattr(subject.task, setting):
        name = subject.task.name
        raise InputError(f"axes={setting} is not for task={name}; leave it out of axes")
    return factor * getattr(subject.task, setting)


def _turned(turn: str) -> Callable[[float, EvaluatedPolicy], Condition]:
    return lambda s, _: Condition(mounts=(mount(turn=turn, degrees=s),))


_MAKE: dict[str, Callable[[float, EvaluatedPolicy], Condition]] = {
    "object_color": lambda s, _: Condition(appearance_changes=(tint(_THINGS, s),)),
    "object_white": lambda s, _: Condition(appearance_changes=(whiten(_THINGS, s),)),
    "floor_color": lambda s, _: Condition(appearance_changes=(tint((SemanticClass.GROUND,), s),)),
    "camera_yaw": _turned("yaw"),
    "camera_pitch": _turned("pitch"),
    "camera_roll": _turned("roll"),
    "camera_height": lambda s, _: Condition(mounts=(mount(offset=(0.0, 0.0, s)),)),
    "camera_sideways": lambda s, _: Condition(mounts=(mount(offset=(0.0, s, 0.0)),)),
    "field_of_view": lambda s, of: Condition(camera={"horizontal_fov": _field_of_view(s, of)}),
    "sun": lambda s, of: Condition(appearance_changes=(sun_at(s, _file_sun(of) or SUN_DIRECTION),)),
    "brightness": lambda s, of: _rendered(of, Condition(appearance_changes=(expose(s),))),
    "fog": lambda s, of: _rendered(of, Condition(appearance_changes=(fog(s),))),
    "object_size": lambda s, of: Condition(task={_size(of): _times(_size(of), s, of)}),
    "distractors": lambda s, of: _cluttered(of, round(s)),
    "noise": lambda s, _: Condition(faults=(noise(s / 255),)),
    "slow_noise": lambda s, _: Condition(faults=(noise(s / 255, CORRELATION_TIME),)),
    "blur": lambda s, _: Condition(faults=(out_of_focus(s),)),
    "dead_rows": lambda s, _: Condition(faults=(dead_rows(round(s)),)),
    "frozen_frames": lambda s, _: Condition(faults=(frozen_frames(s),)),
    "late_frames": lambda s, _: Condition(faults=(late_frames(round(s)),)),
    "step_length": lambda s, of: Condition(task={"step_length": _times("step_length", s, of)}),
    "action_delay": lambda s, _: Condition(delay=round(s)),
}
_VALUE: dict[str, Callable[[float, EvaluatedPolicy], float]] = {
    "field_of_view": _field_of_view,
    "object_size": lambda s, of: _times(_size(of), s, of),
    "step_length": lambda s, of: _times("step_length", s, of),
}
_OWN: dict[str, Callable[[EvaluatedPolicy], float]] = {
    "sun": _sun_elevation,
    "fog": lambda of: _middle(of.appearance.fog_visibility or math.inf),
}
_SCALES = {"brightness": FACTORS, "fog": INVERSE, "object_size": FACTORS, "step_length": FACTORS}


def _axis(name: str, entry: Mapping[str, Any]) -> Axis:
    return Axis(
        **{key: entry[key] for key in ("group", "unit", "neutral")},
        name=name,
        strengths=tuple(entry["strengths"]),
        make=_MAKE[name],
        value=_VALUE.get(name, lambda strength, _: strength),
        own=_OWN.get(name),
        scale=_SCALES.get(name, LINEAR),
        whole=entry.get("whole", False),
    )


AXES = {name: _axis(name, entry) for name, entry in TABLE.items()}
GROUPS = tuple(dict.fromkeys(axis.group for axis in AXES.values()))
"""Kinds of shift, each of one or more axes."""


def check_axes(names: Iterable[str]) -> None:
    """Raise an `InputError` if one of the names is neither an axis nor a group."""
    for name in names:
        if name not in (*GROUPS, *AXES):
            options = ", ".join(dict.fromkeys((*GROUPS, *AXES)))
            meant = did_you_mean(name, (*GROUPS, *AXES))
            raise InputError(f"axes={name} is unknown; give some of: {options}{meant}")


def find_axes(names: Iterable[str] | None, subject: EvaluatedPolicy) -> list[Axis]:
    """Return axes by name or by group, in the order of `AXES`.

    By default these are all that the task has and the policy's renderer can render; whether objects
    have one color to change is known only when they are rendered.

    Raises:
        InputError: A name is unknown, or the axis is not for this task or renderer.
    """
    if names is None:
        return [axis.of(subject) for axis in AXES.values() if _is_for(axis, subject)]
    wanted = [*names]
    check_axes(wanted)
    axes = [axis for axis in AXES.values() if {axis.name, axis.group} & {*wanted}]
    for axis in axes:
        axis.make(axis.strengths[0], subject)  # raises if it is not for the task or renderer
    return [axis.of(subject) for axis in axes]


def _is_for(axis: Axis, subject: EvaluatedPolicy) -> bool:
    try:
        return bool(axis.make(axis.strengths[0], subject))
    except InputError:
        return False
