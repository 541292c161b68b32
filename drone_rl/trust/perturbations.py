"""Perturbations of the robustness evaluation: task, camera, appearance, faults and delays."""

import dataclasses
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, Self

import torch
from torch import Tensor

from drone_rl.config import BaseTaskSettings
from drone_rl.config.commands import Mode
from drone_rl.config.task import ObjectRegion
from drone_rl.envs.fault_models import FaultModel, Sample
from drone_rl.envs.observer import Pipeline, Stage
from drone_rl.sim.rendering import Appearance, Distractors, Scene
from drone_rl.sim.rendering.appearance import AMBIENT, SUN, SUN_DIRECTION, Colors, moved, turned
from drone_rl.sim.rendering.scene import SemanticClass
from drone_rl.sim.rendering.view import LUMA
from drone_rl.sim.visual_randomization import stand
from drone_rl.utils.errors import InputError
from drone_rl.utils.seeding import Stream, torch_generator

DRIFT = 0.1
"""Standard deviation of a step of a drifting perturbation, as a fraction of its strength."""
ONSET_STEP = 20
"""Step at which a perturbation begins in mode "onset": between the first cubes."""
MAX_DISTRACTORS = 16
"""Largest number of distractors."""
_BLUE = (0.2, 0.4, 1.0)
_AWAY = (2.0, 10.0)
"""Distance of distractors from the area of the task, metres, from and to."""


@dataclasses.dataclass(frozen=True)
class AppearanceChange:
    """A change of the appearance, with a variation in each environment."""

    change: Callable[[Appearance, Tensor], Appearance]
    """Takes an appearance and variations from -1 to 1, (num_envs, dimensions), float64."""
    dimensions: int = 0
    """Numbers that a variation has."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Condition:
    """All perturbations at once; none by default."""

    task: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    """Settings of the task to replace."""
    camera: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    """Settings of the camera to replace."""
    appearance_changes: tuple[AppearanceChange, ...] = ()
    """Changes of colors and light; they need those of `scene_appearance`."""
    mounts: tuple[AppearanceChange, ...] = ()
    """Changes of the camera's pose."""
    faults: tuple[FaultModel, ...] = ()
    """Camera faults, in order."""
    delay: int = 0
    """Steps by which actions are late."""
    clutter: int = 0
    """Number of distractors."""

    @property
    def dimensions(self) -> tuple[int, ...]:
        """Numbers in the variation of each appearance change, then of the mounts."""
        return tuple(part.dimensions for part in (*self.appearance_changes, *self.mounts))

    def __or__(self, other: Self) -> "Condition":
        """Combine two conditions; the other one's settings take precedence."""
        return Condition(
            task={**self.task, **other.task},
            camera={**self.camera, **other.camera},
            appearance_changes=self.appearance_changes + other.appearance_changes,
            mounts=self.mounts + other.mounts,
            faults=self.faults + other.faults,
            delay=max(self.delay, other.delay),
            clutter=max(self.clutter, other.clutter),
        )


def variations(
    mode: Mode, dimensions: Sequence[int], num_envs: int, generator: torch.Generator
) -> Iterator[list[Tensor]]:
    """Yield the variations of each step, without end, of all environments, active or not.

    `dimensions` are those of each part of the condition; one tensor per part is yielded. Shapes:
    (num_envs, dimensions), float64.
    """
    shape, is_drifting = (num_envs, sum(dimensions)), mode == "drifting"
    variation = torch.rand(shape, generator=generator, dtype=torch.float64).round() * 2 - 1
    variation = torch.zeros_like(variation) if is_drifting else variation
    while True:
        yield [*variation.split(list(dimensions), -1)]
        if is_drifting:
            step = DRIFT * torch.randn(shape, generator=generator, dtype=torch.float64)
            variation = reflect(variation + step)


def reflect(variation: Tensor) -> Tensor:
    """Reflect numbers at -1 and 1 into that range. Shape kept."""
    return ((variation - 1.0) % 4.0 - 2.0).abs() - 1.0


def scene_appearance(scene: Scene) -> Appearance:
    """Return lights, sky and colors of a scene, without distractors.

    A class whose geoms differ in color is left out, so that it stays as in the model.
    """
    classes = {*scene.semantic_classes} - {SemanticClass.DISTRACTOR}
    by_class = {m: {*map(tuple, scene.colors[scene.geoms(m), :3].tolist())} for m in classes}
    colors = {m: next(iter(shades)) for m, shades in by_class.items() if len(shades) == 1}
    if scene.is_file:
        return Appearance(colors=colors, ambient=(AMBIENT, AMBIENT, AMBIENT), sun=(SUN, SUN, SUN))
    model = scene.model
    lights = (model.light_ambient[0], model.light_diffuse[0], model.light_dir[0])
    ambient, sun, direction = (tuple(light.tolist()) for light in lights)
    return Appearance(
        colors={**colors, SemanticClass.SKY: scene.sky},
        ambient=ambient,
        sun=sun,
        sun_direction=direction,
    )


def tint(classes: Sequence[SemanticClass], by: float) -> AppearanceChange:
    """Shift red, green and blue of some classes by up to `by`, differently in each environment."""
    return AppearanceChange(
        lambda look, v: _repaint(look, classes, lambda color: (color.to(v) + by * v).clamp(0, 1)), 3
    )


def whiten(classes: Sequence[SemanticClass], fraction: float) -> AppearanceChange:
    """Mix this fraction of white into the colors of some classes."""
    return AppearanceChange(
        lambda look, _: _repaint(look, classes, lambda color: color + fraction * (1.0 - color))
    )


def sun_at(degrees: float, own: tuple[float, float, float] = SUN_DIRECTION) -> AppearanceChange:
    """Set the elevation of the sun above the horizon and keep its azimuth.

    `own` is the direction of sunlight in the scene, for appearances without one.
    """

    def change(appearance: Appearance, variation: Tensor) -> Appearance:
        direction = appearance.sun_direction
        ahead = _tensor(own if direction is None else direction)[..., :2]
        is_above = ahead.norm(dim=-1, keepdim=True) < 1e-6
        ahead = torch.where(is_above, _tensor(SUN_DIRECTION)[:2], ahead)
        ahead = ahead / ahead.norm(dim=-1, keepdim=True)
        angle = math.radians(degrees)
        down = torch.full_like(ahead[..., :1], -math.sin(angle))
        direction = torch.cat([math.cos(angle) * ahead, down], -1)
        return dataclasses.replace(appearance, sun_direction=direction)

    return AppearanceChange(change)


def expose(gain: float) -> AppearanceChange:
    """Multiply the camera's exposure; values above white are white."""

    def change(appearance: Appearance, variation: Tensor) -> Appearance:
        exposure = 1.0 if appearance.exposure is None else appearance.exposure
        return dataclasses.replace(appearance, exposure=gain * exposure)

    return AppearanceChange(change)


def fog(visibility: float) -> AppearanceChange:
    """Set the visibility in metres, see `Appearance.fog_visibility`."""
    return AppearanceChange(lambda look, _: dataclasses.replace(look, fog_visibility=visibility))


def mount(
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0), turn: str = "yaw", degrees: float = 0.0
) -> AppearanceChange:
    """Move the camera and turn it about itself, in either direction.

    The offset is in metres in the drone frame: forward, to the left, up. See
    `drone_rl.sim.rendering.appearance.AXES` for the axes to turn about.
    """

    def change(appearance: Appearance, variation: Tensor) -> Appearance:
        shift = variation * variation.new_tensor(offset)
        rotation = turned(turn, variation[:, 0] * degrees).to(variation)
        return dataclasses.replace(appearance, camera=moved(appearance.camera, shift, rotation))

    return AppearanceChange(change, 1)


def task_region(settings: BaseTaskSettings) -> ObjectRegion:
    """Return where a task's objects are, their size and color; an `InputError` without any."""
    if settings.object_region is None:
        raise InputError(f"axes=distractors is not for task={settings.name}; leave it out of axes")
    return settings.object_region


def as_bright(color: Sequence[float]) -> tuple[float, ...]:
    """Return a blue of the same luminance as a color, as far as possible."""
    wanted, has = (sum(w * c for w, c in zip(LUMA, rgb, strict=True)) for rgb in (color, _BLUE))
    return tuple(min(1.0, wanted / has * c) for c in _BLUE)


def sample_distractors(region: ObjectRegion, num_envs: int, generator: torch.Generator) -> Tensor:
    """Sample positions of distractors next to the area of the task, metres, world frame.

    Shape: (num_envs, MAX_DISTRACTORS, 3), float64.
    """
    near, far = _AWAY
    sampled = torch.rand(num_envs, MAX_DISTRACTORS, 3, generator=generator, dtype=torch.float64)
    ahead = region.first / 2 + sampled[..., 0] * region.last
    is_left = sampled[..., 2].round().bool()
    return stand(region, ahead, near + sampled[..., 1] * (far - near), is_left, region.altitude)


def clutter(appearance: Appearance | None, region: ObjectRegion, places: Tensor) -> Appearance:
    """Add distractors of the size, height and luminance of the task's objects.

    Their places are in metres, world frame. Shape: (num_envs, count, 3).
    """
    color = torch.tensor(as_bright(region.color)).to(places)
    more = Distractors(
        places=places,
        sizes=torch.full_like(places[..., 0], region.size),
        colors=color.expand(places.shape),
    )
    appearance = appearance or Appearance()
    distractors = appearance.distractors
    return dataclasses.replace(
        appearance, distractors=more if distractors is None else distractors.concat(more)
    )


class SharedStream:
    """Random numbers of one fault in all environments, whichever of them are running."""

    def __init__(self, generator: torch.Generator, num_envs: int) -> None:
        self._generator, self._num_envs = generator, num_envs

    def __call__(self, rows: Tensor, *, begins: bool) -> Sample:
        """See `drone_rl.envs.observer.Source`."""

        def sample(*shape: int, normal: bool = False) -> Tensor:
            draw = torch.randn if normal else torch.rand
            every = draw(self._num_envs, *shape, generator=self._generator)
            return every.to(rows.device)[rows]

        return sample


def make_faults(
    models: Sequence[FaultModel],
    num_envs: int,
    seed: int,
    *,
    image: int = 0,
    hiding_only: bool = False,
) -> Pipeline:
    """Return faults in the order in which they act; each has a random stream of its own.

    `image` is the number of the image among several that a policy sees. `hiding_only` leaves out
    those that hide nothing.
    """
    first = 1 + image * len(models)
    streams = (torch_generator(seed, Stream.SHIFTS, number=first + i) for i in range(len(models)))
    return Pipeline(
        stages=[
            Stage(model, SharedStream(stream, num_envs))
            for model, stream in zip(models, streams, strict=True)
            if model.hides or not hiding_only
        ]
    )


def _repaint(
    appearance: Appearance, classes: Sequence[SemanticClass], paint: Callable[[Tensor], Tensor]
) -> Appearance:
    painted = {m: paint(_tensor(c)) for m, c in appearance.colors.items() if m in classes}
    if not painted:
        raise InputError(
            "the task has no objects of one color to change; leave object_color and object_white "
            "out of axes"
        )
    return dataclasses.replace(appearance, colors={**appearance.colors, **painted})


def _tensor(value: Colors) -> Tensor:
    return torch.as_tensor(value, dtype=torch.float64)
