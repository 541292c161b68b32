"""All axes, with the strengths at which every policy is tried.

The strengths mirror published ones: colours Distracting Control Suite (Stone et al., 2021) and
DMControl Generalization Benchmark (Hansen and Wang, 2021), camera angles the former's three levels
and two below, sizes The Colosseum (Pumacay et al., 2024), correlated noise Nasvytis et al. (2024).
"""

import dataclasses
import math
from collections.abc import Callable, Iterable
from typing import NamedTuple

from drone_rl.robustness.faults import Blur, DeadRows, Frozen, Late, Noise
from drone_rl.robustness.paired_evaluation import Subject
from drone_rl.robustness.perturbations import (
    Condition,
    Exposed,
    Fogged,
    Mount,
    SunAt,
    Tinted,
    Whitened,
    told_by,
)
from drone_rl.sim.rendering.scene import SemanticClass
from drone_rl.utils.errors import InputError

NUMBERS = (1, 2, 3, 4, 5)
"""Of the strengths, from the weakest on."""
TOGETHER = 3
"""The strength at which all axes are tried together."""


class Scale(NamedTuple):
    """Along which steps of an axis are compared: areas are taken and middles are found on it."""

    there: Callable[[float], float]
    back: Callable[[float], float]
    rises: bool = True
    """Whether greater values lie higher on it."""


LINEAR = Scale(float, float)
FACTORS = Scale(math.log, math.exp)
"""Half as much is as far as twice as much."""
INVERSE = Scale(lambda x: 1.0 / x, lambda x: math.inf if x == 0 else 1.0 / x, rises=False)
"""Infinitely much is none."""


def _as_it_is(strength: float, subject: Subject) -> float:
    return strength


@dataclasses.dataclass(frozen=True)
class Axis:
    """One thing that can be different."""

    name: str
    group: str
    """One of the ten kinds of shift."""
    unit: str
    """Of its values."""
    neutral: float
    """The strength of no difference."""
    strengths: tuple[float, float, float, float, float]
    """From the weakest on; those of an axis with two ends lie on both sides of the neutral one."""
    make: Callable[[float, Subject], Condition]
    """What a strength makes different for a policy.

    Raises:
        InputError: This task has no such thing.
    """
    value: Callable[[float, Subject], float] = _as_it_is
    """A strength in the axis's unit, where strengths are told by what the policy has itself."""
    own: Callable[[Subject], float] | None = None
    """What the neutral strength is for a policy, where that is not the same for all."""
    scale: Scale = LINEAR
    whole: bool = False
    """Whether there is nothing between whole numbers."""
    touched_by: tuple[str, ...] = ()
    """Settings of a training that make a difference of this kind, as in appearance.exposure: a
    training in which one of them is not as by default knows the axis."""

    def position(self, strength: float) -> float:
        """Where a strength lies on the axis's scale; 0 where nothing is different."""
        return self.scale.there(strength) - self.scale.there(self.neutral)

    @property
    def signs(self) -> dict[str, int]:
        """By end of a range of values, "low" and "high", on which side of the scale it lies."""
        return {"low": -1, "high": 1} if self.scale.rises else {"low": 1, "high": -1}

    def strength(self, value: float, subject: Subject) -> float:
        """The strength that has this value for a policy: the inverse of `value`, which is affine.

        Args:
            value: In the axis's unit.
            subject: The policy.
        """
        if not math.isfinite(value):
            return value
        zero, one = (self.value(strength, subject) for strength in (0.0, 1.0))
        strength = (value - zero) / (one - zero)
        return float(round(strength)) if self.whole else strength

    def between(self, low: float, high: float, share: float = 0.5) -> float | None:
        """The strength a share of the way from one to another; None where there is none."""
        there, back, _ = self.scale
        if not self.whole:
            return back(there(low) + share * (there(high) - there(low)))
        inside = round(abs(high - low)) - 1
        nearer = 1 + min(math.floor(share * inside), inside - 1)
        return math.copysign(nearer, high - low) + low if inside > 0 else None

    def at(self, position: float) -> float:
        """The strength that lies there on the axis's scale."""
        return self.scale.back(position + self.scale.there(self.neutral))


CORRELATION_TIME = -1.0 / math.log(0.95)
"""Frames: of one frame's noise 0.95 is left in the next."""
_THINGS = (SemanticClass.TARGET, SemanticClass.OBSTACLE)
_SIZES = {"collect_cubes": "cube_size", "pillars": "width"}
_FACTORS = (0.9, 1.25, 0.75, 1.5, 0.5)
_ANGLES = (1.0, 3.0, 9.0, 18.0, 27.0)
_METRES = (0.1, 0.25, 0.5, 1.0, 2.0)


def _below(part: str, *names: str) -> tuple[str, ...]:
    return tuple(f"{part}.{name}" for name in names)


_OBJECTS = (
    *_below("appearance", "object_color", "object_texture", "object_tile"),
    *_below("task", "cube_color", "pillar_color"),
)
_LIGHT = _below("appearance", "sun_strength", "sun_color", "ambient_strength")
_TURNED = ("transforms.shift", "appearance.camera_turn")
"""A picture that stands aside looks as if the camera had been turned."""
_MOVED = ("appearance.camera_offset",)
_DISTRACTORS = _below(
    *("appearance", "distractors", "distractor_size", "distractor_color", "distractor_distance")
)


def _size(subject: Subject) -> str:
    name = subject.task.name
    if name not in _SIZES:
        raise InputError(f"axis=object_size is not for task={name}; leave it out of axes")
    return _SIZES[name]


def _drawn(subject: Subject, condition: Condition) -> Condition:
    """A condition that our own ray tracer alone can draw."""
    if subject.renderer != "raytrace":
        raise InputError(
            f"renderer={subject.renderer} can't draw fog and exposure; give axes without fog and "
            "brightness, or renderer=raytrace"
        )
    return condition


def _cluttered(subject: Subject, count: int) -> Condition:
    told_by(subject.task)
    return Condition(clutter=count)


def _middle(value: float | tuple[float, float]) -> float:
    """What it is, or is on average where it is drawn from a range."""
    return sum(value) / 2 if isinstance(value, tuple) else value


def _times(setting: str, factor: float, subject: Subject) -> float:
    return factor * getattr(subject.task, setting)


AXES: dict[str, Axis] = {
    axis.name: axis
    for axis in (
        Axis(
            *("object_color", "color", "of each color", 0.0, (0.025, 0.05, 0.1, 0.2, 0.3)),
            lambda s, _: Condition(looks=(Tinted(_THINGS, s),)),
            touched_by=_OBJECTS,
        ),
        Axis(
            *("object_white", "color", "of white", 0.0, (0.1, 0.2, 0.4, 0.6, 0.8)),
            lambda s, _: Condition(looks=(Whitened(_THINGS, s),)),
            touched_by=_OBJECTS,
        ),
        Axis(
            *("floor_color", "color", "of each color", 0.0, (0.025, 0.05, 0.1, 0.2, 0.3)),
            lambda s, _: Condition(looks=(Tinted((SemanticClass.GROUND,), s),)),
            touched_by=_below("appearance", "ground_color", "ground_texture", "ground_tile"),
        ),
        Axis(
            *("camera_yaw", "camera angle", "degrees", 0.0, _ANGLES),
            lambda s, _: Condition(mounts=(Mount(turn="yaw", degrees=s),)),
            touched_by=_TURNED,
        ),
        Axis(
            *("camera_pitch", "camera angle", "degrees", 0.0, _ANGLES),
            lambda s, _: Condition(mounts=(Mount(turn="pitch", degrees=s),)),
            touched_by=_TURNED,
        ),
        Axis(
            *("camera_roll", "camera angle", "degrees", 0.0, _ANGLES),
            lambda s, _: Condition(mounts=(Mount(turn="roll", degrees=s),)),
            touched_by=("appearance.camera_turn",),
        ),
        Axis(
            *("camera_height", "camera position", "m", 0.0, _METRES),
            lambda s, _: Condition(mounts=(Mount(offset=(0.0, 0.0, s)),)),
            touched_by=_MOVED,
        ),
        Axis(
            *("camera_sideways", "camera position", "m", 0.0, _METRES),
            lambda s, _: Condition(mounts=(Mount(offset=(0.0, s, 0.0)),)),
            touched_by=_MOVED,
        ),
        Axis(
            *("field_of_view", "field of view", "degrees", 0.0, (-10.0, 10.0, -20.0, 20.0, -45.0)),
            lambda s, of: Condition(camera={"horizontal_fov": of.camera.horizontal_fov + s}),
            value=lambda s, of: of.camera.horizontal_fov + s,
            touched_by=("camera.horizontal_fov", "appearance.camera_widening"),
        ),
        Axis(
            *("sun", "light", "degrees", 55.2, (60.0, 30.0, 15.0, 5.0, 0.0)),
            lambda s, _: Condition(looks=(SunAt(s),)),
            own=lambda of: _middle(of.appearance.sun_elevation),
            touched_by=(*_LIGHT, *_below("appearance", "sun_elevation", "sun_azimuth", "shadows")),
        ),
        Axis(
            *("brightness", "light", "times", 1.0, (0.8, 1.25, 0.4, 2.5, 0.1)),
            lambda s, of: _drawn(of, Condition(looks=(Exposed(s),))),
            scale=FACTORS,
            touched_by=("appearance.exposure", *_LIGHT),
        ),
        Axis(
            *("fog", "fog", "m of sight", math.inf, (100.0, 60.0, 40.0, 25.0, 15.0)),
            lambda s, of: _drawn(of, Condition(looks=(Fogged(s),))),
            own=lambda of: _middle(of.appearance.fog_visibility or math.inf),
            scale=INVERSE,
            touched_by=_below("appearance", "fog_visibility", "sky_horizon", "sky_zenith"),
        ),
        Axis(
            *("object_size", "object size", "m", 1.0, _FACTORS),
            lambda s, of: Condition(task={_size(of): _times(_size(of), s, of)}),
            value=lambda s, of: _times(_size(of), s, of),
            scale=FACTORS,
            touched_by=_below("task", *_SIZES.values()),
        ),
        Axis(
            *("distractors", "distractors", "of them", 0.0, (1.0, 2.0, 4.0, 8.0, 16.0)),
            lambda s, of: _cluttered(of, round(s)),
            whole=True,
            touched_by=_DISTRACTORS,
        ),
        Axis(
            *("noise", "sensor", "of 255", 0.0, (2.0, 4.0, 8.0, 16.0, 32.0)),
            lambda s, _: Condition(faults=(Noise(s / 255),)),
            touched_by=("transforms.noise",),
        ),
        Axis(
            *("slow_noise", "sensor", "of 255", 0.0, (2.0, 4.0, 8.0, 16.0, 32.0)),
            lambda s, _: Condition(faults=(Noise(s / 255, CORRELATION_TIME),)),
            touched_by=("transforms.noise",),
        ),
        Axis(
            *("blur", "sensor", "pixels", 0.0, (0.5, 0.75, 1.0, 1.5, 2.0)),
            lambda s, _: Condition(faults=(Blur(s),)),
            touched_by=("transforms.blur",),
        ),
        Axis(
            *("dead_rows", "sensor", "rows", 0.0, (1.0, 2.0, 4.0, 8.0, 12.0)),
            lambda s, _: Condition(faults=(DeadRows(round(s)),)),
            whole=True,
            touched_by=("transforms.dead_rows",),
        ),
        Axis(
            *("frozen_frames", "sensor", "of frames", 0.0, (0.1, 0.2, 0.4, 0.6, 0.8)),
            lambda s, _: Condition(faults=(Frozen(s),)),
            touched_by=("transforms.frozen_frames",),
        ),
        Axis(
            *("late_frames", "sensor", "frames", 0.0, (1.0, 2.0, 3.0, 4.0, 5.0)),
            lambda s, _: Condition(faults=(Late(round(s)),)),
            whole=True,
            touched_by=("transforms.late_frames",),
        ),
        Axis(
            *("step_length", "dynamics", "m", 1.0, _FACTORS),
            lambda s, of: Condition(task={"step_length": _times("step_length", s, of)}),
            value=lambda s, of: _times("step_length", s, of),
            scale=FACTORS,
            touched_by=("task.step_length",),
        ),
        Axis(
            *("action_delay", "dynamics", "steps", 0.0, (1.0, 2.0, 3.0, 4.0, 5.0)),
            lambda s, _: Condition(delay=round(s)),
            whole=True,
            touched_by=("transforms.late_frames",),  # to who sees, late is late
        ),
    )
}
GROUPS = tuple(dict.fromkeys(axis.group for axis in AXES.values()))
"""Kinds of shift, each of one axis or several."""


def check_axes(names: Iterable[str]) -> None:
    """Refuses what is neither an axis nor a group.

    Raises:
        InputError: One of the names is neither; those that exist are named.
    """
    for name in names:
        if name not in (*GROUPS, *AXES):
            known = ", ".join(dict.fromkeys((*GROUPS, *AXES)))
            raise InputError(f"axes={name} is unknown; give some of: {known}")


def find_axes(names: Iterable[str] | None, subject: Subject) -> list[Axis]:
    """Axes by name or by group, in the order of `AXES`.

    Args:
        names: Which; all that the task has by default.
        subject: Whom they are tried on.

    Raises:
        InputError: There is none of that name, or none for this task.
    """
    if names is None:
        return [_owned(axis, subject) for axis in AXES.values() if _is_for(axis, subject)]
    wanted = [*names]
    check_axes(wanted)
    found = [axis for axis in AXES.values() if {axis.name, axis.group} & {*wanted}]
    for axis in found:
        axis.make(axis.strengths[0], subject)  # refuses now what is not for this task
    return [_owned(axis, subject) for axis in found]


def _owned(axis: Axis, subject: Subject) -> Axis:
    """With the policy's own neutral strength."""
    return axis if axis.own is None else dataclasses.replace(axis, neutral=axis.own(subject))


def _is_for(axis: Axis, subject: Subject) -> bool:
    try:
        axis.make(axis.strengths[0], subject)
    except InputError:
        return False
    return True
