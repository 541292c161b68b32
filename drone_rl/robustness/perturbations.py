"""The camera mounted elsewhere on the drone, or turned there."""

import dataclasses
import enum
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, Protocol, Self

import torch
from torch import Tensor

from drone_rl.config import BaseTaskSettings
from drone_rl.config.task import Things
from drone_rl.robustness.faults import Fault
from drone_rl.sim.clutter import stand
from drone_rl.sim.rendering import Appearance, Distractors, Scene
from drone_rl.sim.rendering.appearance import Colors, moved, turned
from drone_rl.sim.rendering.scene import SemanticClass
from drone_rl.sim.rendering.view import LUMA
from drone_rl.utils.errors import InputError


@dataclasses.dataclass(frozen=True)
class Mount:
    """A camera that is moved, and turned about itself."""

    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Metres, drone frame: forward, to the left, up."""
    turn: str = "yaw"
    """Around which axis of the drone, see `drone_rl.sim.rendering.appearance.AXES`."""
    degrees: float = 0.0
    dimensions: int = 1
    """One number: 1 as stated, -1 the opposite way."""

    def __call__(self, appearance: Appearance | None, sway: Tensor) -> Appearance:
        """The same look through the camera so mounted.

        Args:
            appearance: As in the model by default.
            sway: How much of it, from -1 to 1. Shape: (num_worlds, 1).
        """
        appearance = appearance or Appearance()
        offset = sway * sway.new_tensor(self.offset)
        turn = turned(self.turn, sway[:, 0] * self.degrees).to(sway)
        camera = moved(appearance.camera, offset, turn)
        return dataclasses.replace(appearance, camera=camera)


DRIFT = 0.1
"""Standard deviation of a step of what drifts, where 1 is the whole strength."""
ONSET_STEP = 20
"""The step at which a condition sets in during the flight: between the first cubes."""


class Mode(enum.StrEnum):
    """When it holds."""

    CONSTANT = "constant"
    """From start to end, in each world in one of the extreme ways, drawn at the start."""
    DRIFTING = "drifting"
    """In each world a random walk that begins with no difference and stays within the strength."""
    ONSET = "onset"
    """As constant, but only from `ONSET_STEP` on."""


def sways(
    mode: Mode, dimensions: Sequence[int], num_worlds: int, generator: torch.Generator
) -> Iterator[list[Tensor]]:
    """What each step's ways are, without end.

    Args:
        mode: Which.
        dimensions: Of each part of a condition.
        num_worlds: In all, whether they still fly or not.
        generator: Where they are drawn from.

    Yields:
        One tensor a part. Shapes: (num_worlds, dimensions), float64.
    """
    shape = (num_worlds, sum(dimensions))
    way = torch.rand(shape, generator=generator, dtype=torch.float64).round() * 2 - 1
    if mode is not Mode.DRIFTING:
        while True:
            yield [*way.split(list(dimensions), -1)]
    way = torch.zeros_like(way)
    while True:
        yield [*way.split(list(dimensions), -1)]
        step = DRIFT * torch.randn(shape, generator=generator, dtype=torch.float64)
        way = reflect(way + step)


def reflect(way: Tensor) -> Tensor:
    """Numbers put back between -1 and 1 as by mirrors that stand there. Shape kept."""
    return ((way - 1.0) % 4.0 - 2.0).abs() - 1.0


def look_of(scene: Scene) -> Appearance:
    """How a scene looks, with all of it given but for distractors, which are told one by one."""
    known = [m for m in scene.semantic_classes if m is not SemanticClass.DISTRACTOR]
    colors = {m: tuple(scene.colors[scene.geoms(m)[0], :3].tolist()) for m in known}
    model = scene.model
    lights = (model.light_ambient[0], model.light_diffuse[0], model.light_dir[0])
    ambient, sun, direction = (tuple(light.tolist()) for light in lights)
    return Appearance(
        colors={**colors, SemanticClass.SKY: scene.sky},
        ambient=ambient,
        sun=sun,
        sun_direction=direction,
    )


@dataclasses.dataclass(frozen=True)
class Tinted:
    """Things whose red, green and blue differ, each world in its own way."""

    meanings: tuple[SemanticClass, ...]
    """Of what; the others and what is not there stay as they are."""
    by: float
    """At most, of colours from 0 to 1."""
    dimensions: int = 3

    def __call__(self, appearance: Appearance, sway: Tensor) -> Appearance:
        """See `Look`."""
        return _painted(
            appearance, self.meanings, lambda own: (own.to(sway) + self.by * sway).clamp(0, 1)
        )


@dataclasses.dataclass(frozen=True)
class Whitened:
    """Things with white mixed into their colour."""

    meanings: tuple[SemanticClass, ...]
    share: float
    """Of white: 1 leaves nothing of the colour."""
    dimensions: int = 0

    def __call__(self, appearance: Appearance, sway: Tensor) -> Appearance:
        """See `Look`."""
        return _painted(appearance, self.meanings, lambda own: own + self.share * (1.0 - own))


@dataclasses.dataclass(frozen=True)
class SunAt:
    """The sun at another height, from where it was otherwise."""

    elevation: float
    """Degrees above the horizon."""
    dimensions: int = 0

    def __call__(self, appearance: Appearance, sway: Tensor) -> Appearance:
        """See `Look`."""
        assert appearance.sun_direction is not None
        ahead = _tensor(appearance.sun_direction)[..., :2]
        ahead = ahead / ahead.norm(dim=-1, keepdim=True)
        angle = math.radians(self.elevation)
        down = torch.full_like(ahead[..., :1], -math.sin(angle))
        direction = torch.cat([math.cos(angle) * ahead, down], -1)
        return dataclasses.replace(appearance, sun_direction=direction)


@dataclasses.dataclass(frozen=True)
class Exposed:
    """More light or less: the camera's exposure."""

    gain: float
    """How many times as much; what is brighter than white is white."""
    dimensions: int = 0

    def __call__(self, appearance: Appearance, sway: Tensor) -> Appearance:
        """See `Look`."""
        own = 1.0 if appearance.exposure is None else appearance.exposure
        return dataclasses.replace(appearance, exposure=self.gain * own)


@dataclasses.dataclass(frozen=True)
class Fogged:
    """Fog."""

    visibility: float
    """Metres, see `Appearance.fog`."""
    dimensions: int = 0

    def __call__(self, appearance: Appearance, sway: Tensor) -> Appearance:
        """See `Look`."""
        return dataclasses.replace(appearance, fog=self.visibility)


def elevation(direction: Colors) -> float:
    """Height of a sun whose light goes there, degrees above the horizon."""
    x, y, z = _tensor(direction).tolist()
    return math.degrees(math.atan2(-z, math.hypot(x, y)))


def _painted(
    appearance: Appearance, meanings: tuple[SemanticClass, ...], paint: Callable[[Tensor], Tensor]
) -> Appearance:
    there = {m: paint(_tensor(c)) for m, c in appearance.colors.items() if m in meanings}
    return dataclasses.replace(appearance, colors={**appearance.colors, **there})


def _tensor(value: Colors) -> Tensor:
    return torch.as_tensor(value, dtype=torch.float64)


MOST = 16
_BLUE = (0.2, 0.4, 1.0)
_AWAY = (2.0, 10.0)
"""Metres, from and to, by which they stand outside of where anything matters."""


def told_by(settings: BaseTaskSettings) -> Things:
    """Where a task's things stand, how large and of which colour.

    Raises:
        InputError: Nothing is known of such a task.
    """
    if settings.things is None:
        raise InputError(f"axes=distractors is not for task={settings.name}; leave it out of axes")
    return settings.things


def as_bright(color: Sequence[float]) -> tuple[float, ...]:
    """A blue that is as bright as a colour, as far as there is one."""
    wanted, has = (sum(w * c for w, c in zip(LUMA, rgb, strict=True)) for rgb in (color, _BLUE))
    return tuple(min(1.0, wanted / has * c) for c in _BLUE)


def draw_places(things: Things, num_worlds: int, generator: torch.Generator) -> Tensor:
    """Where distractors stand; fewer of them are the first of these.

    Args:
        things: Of the task.
        num_worlds: How many.
        generator: Where they are drawn from.

    Returns:
        Metres, world frame. Shape: (num_worlds, MOST, 3), float64.
    """
    near, far = _AWAY
    drawn = torch.rand(num_worlds, MOST, 3, generator=generator, dtype=torch.float64)
    ahead = things.first / 2 + drawn[..., 0] * things.last
    is_left = drawn[..., 2].round().bool()
    return stand(things, ahead, near + drawn[..., 1] * (far - near), is_left, things.altitude)


def clutter(appearance: Appearance | None, things: Things, places: Tensor) -> Appearance:
    """The same look with more distractors.

    Args:
        appearance: As in the model by default.
        things: Of the task.
        places: Where they stand. Shape: (num_worlds, count, 3).
    """
    color = torch.tensor(as_bright(things.color)).to(places)
    more = Distractors(
        places=places,
        sizes=torch.full_like(places[..., 0], things.size),
        colors=color.expand(places.shape),
    )
    appearance = appearance or Appearance()
    own = appearance.distractors
    return dataclasses.replace(appearance, distractors=more if own is None else own.concat(more))


class Look(Protocol):
    """Makes worlds look otherwise than they did, each in a way of its own."""

    @property
    def dimensions(self) -> int:
        """How many numbers say in which way, each from -1 to 1."""
        ...

    def __call__(self, appearance: Appearance, sway: Tensor) -> Appearance:
        """The look.

        Args:
            appearance: Before; all of it is given.
            sway: In which way. Shape: (num_worlds, dimensions), float64.
        """
        ...


@dataclasses.dataclass(frozen=True, kw_only=True)
class Condition:
    """All that is different at once; nothing by default."""

    task: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    """Settings of the task that have other values."""
    camera: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    """The same of the camera."""
    looks: tuple[Look, ...] = ()
    mounts: tuple[Mount, ...] = ()
    """How the camera is mounted otherwise."""
    faults: tuple[Fault, ...] = ()
    """What becomes of pictures once they are taken, in order."""
    delay: int = 0
    """Steps by which actions come late."""
    clutter: int = 0
    """Distractors beside the way."""

    @property
    def dimensions(self) -> tuple[int, ...]:
        """Of the looks, then of the mounts: numbers from -1 to 1 that tell worlds apart."""
        return tuple(part.dimensions for part in (*self.looks, *self.mounts))

    def __or__(self, other: Self) -> "Condition":
        """Both at once; of what both set, the other one's value."""
        return Condition(
            task={**self.task, **other.task},
            camera={**self.camera, **other.camera},
            looks=self.looks + other.looks,
            mounts=self.mounts + other.mounts,
            faults=self.faults + other.faults,
            delay=max(self.delay, other.delay),
            clutter=max(self.clutter, other.clutter),
        )
