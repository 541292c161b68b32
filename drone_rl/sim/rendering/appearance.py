"""How things look: colours, light, textures and air, which may differ from world to world."""

import dataclasses
import math
from collections.abc import Mapping
from typing import Any

import torch
from torch import Tensor

from drone_rl.sim.rendering.scene import Meaning

AXES = {"roll": (1.0, 0.0, 0.0), "pitch": (0.0, 1.0, 0.0), "yaw": (0.0, 0.0, 1.0)}
"""What a camera turns around, drone frame: x forward, y left, z up."""
_LEVEL = (1.0, 0.0, 0.0, 0.0)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Mounting:
    """How one camera differs from the model's; each value is one for all worlds or one for each."""

    camera: str = "drone/front_center"
    """Its full name in the model; all others stay as they are."""
    offset: tuple[float, ...] | Tensor = (0.0, 0.0, 0.0)
    """Metres, drone frame. Shape: (3,) or (num_worlds, 3)."""
    turn: tuple[float, ...] | Tensor = _LEVEL
    """About its own place, drone frame, a quaternion (w, x, y, z). Shape: (4,) or
    (num_worlds, 4)."""
    zoom: float | Tensor | None = None
    """How many times as large things look in the middle of the picture. Shape: () or
    (num_worlds,)."""


def moved(mounting: Mounting | None, offset: Tensor, turn: Tensor) -> Mounting:
    """A camera that is moved, then turned about itself, both in the frame that it had before.

    Args:
        mounting: How it was mounted; as in the model by default.
        offset: Metres. Shape: (num_worlds, 3).
        turn: Quaternions. Shape: (num_worlds, 4).
    """
    own = mounting or Mounting()
    before = torch.as_tensor(own.turn, dtype=offset.dtype).to(offset.device)
    there = torch.as_tensor(own.offset, dtype=offset.dtype).to(offset.device)
    return dataclasses.replace(
        own, offset=there + rotate(before, offset), turn=product(before, turn)
    )


def turned(axis: str, degrees: float | Tensor) -> Tensor:
    """Quaternions of turns around one of `AXES`. Shape: (*, 4) of degrees of shape (*)."""
    half = torch.deg2rad(torch.as_tensor(degrees, dtype=torch.float64)) / 2
    around = half.new_tensor(AXES[axis])
    return torch.cat([half.cos()[..., None], half.sin()[..., None] * around], -1)


def zoom_of(own: float, wanted: Tensor) -> Tensor:
    """How much larger things look by another field of view.

    Args:
        own: Degrees.
        wanted: Degrees. Shape: (*).
    """
    return math.tan(math.radians(own) / 2) / torch.tan(torch.deg2rad(wanted) / 2)


def product(a: Tensor, b: Tensor) -> Tensor:
    """Quaternions (w, x, y, z) one after the other: b in the frame that a makes. Shapes: (*, 4)."""
    a, b = torch.broadcast_tensors(a, b)
    scalar = a[..., :1] * b[..., :1] - (a[..., 1:] * b[..., 1:]).sum(-1, keepdim=True)
    cross = torch.linalg.cross(a[..., 1:], b[..., 1:])
    return torch.cat([scalar, a[..., :1] * b[..., 1:] + b[..., :1] * a[..., 1:] + cross], -1)


def rotate(attitude: Tensor, vector: Tensor) -> Tensor:
    """A vector in the frame in which an attitude is given. Shapes: (*, 4) and (*, 3)."""
    axis, vector = torch.broadcast_tensors(attitude[..., 1:], vector)
    twice = 2 * torch.linalg.cross(axis, vector)
    return vector + attitude[..., :1] * twice + torch.linalg.cross(axis, twice)


Color = tuple[float, float, float]
"""Red, green, blue, from 0 to 1."""
Several = Color | Tensor
"""One for all worlds, or one for each: shape (num_worlds, 3)."""
Numbers = float | Tensor
"""One for all worlds, or one for each: shape (num_worlds,)."""
_LIGHTS = ("ambient", "sun", "sun_direction")


@dataclasses.dataclass(frozen=True, kw_only=True)
class Texture:
    """A picture that covers things, tile by tile; its colours are multiplied by theirs."""

    pictures: tuple[str, ...]
    """Names or files, see `textures.load`: all of those that worlds choose from."""
    size: Numbers
    """Edge of a tile, metres."""
    choice: Numbers = 0
    """Which of the pictures, a whole number; -1 for none."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Beside:
    """The distractors; those of one world for all, or of each."""

    places: Tensor
    """Metres, world frame. Shape: (num_worlds, count, 3) or (count, 3)."""
    sizes: Tensor
    """Edges or diameters, metres: factors, for they are 1 m in the model.
    Shape: (num_worlds, count) or (count,)."""
    colors: Tensor
    """Shape: as that of `places`."""

    def of(self, num_worlds: int) -> "Beside":
        """Those of so many worlds, each with its own."""
        count = self.places.shape[-2]
        return Beside(
            places=self.places.expand(num_worlds, count, 3),
            sizes=self.sizes.expand(num_worlds, count),
            colors=self.colors.expand(num_worlds, count, 3),
        )

    def and_more(self, other: "Beside") -> "Beside":
        """These, then others of as many worlds."""
        own = self.of(len(other.places))
        return Beside(
            places=torch.cat([own.places, other.places], 1),
            sizes=torch.cat([own.sizes, other.sizes], 1),
            colors=torch.cat([own.colors, other.colors], 1),
        )


@dataclasses.dataclass(frozen=True, kw_only=True)
class Appearance:
    """What looks otherwise than in the model; what is not given stays as it is there."""

    colors: Mapping[Meaning, Several] = dataclasses.field(default_factory=dict)
    """Of all things with a meaning, the sky's among them."""
    ambient: Several | None = None
    """Light from everywhere."""
    sun: Several | None = None
    """Light of the sun."""
    sun_direction: Several | None = None
    """Where its light goes, world frame; need not be of length 1."""
    zenith: Several | None = None
    """Colour of the sky overhead; the sky's own is then that at the horizon, and between them it
    goes with the sine of the elevation."""
    fog: Numbers | None = None
    """Visibility in metres: at this distance 95% of a thing's contrast to the horizon is lost
    (meteorological optical range, WMO-No. 8). Infinite for clear air."""
    shadows: Numbers | None = None
    """Whether solids keep the sun from what is behind them: 1 or 0."""
    exposure: Numbers | None = None
    """The camera multiplies all colours by it before it cuts them off at white."""
    textures: Mapping[Meaning, Texture] = dataclasses.field(default_factory=dict)
    """Of things with a meaning, but for the sky."""
    camera: Mounting | None = None
    """How a camera differs from the model's."""
    beside: Beside | None = None
    """The distractors: their colours and sizes are drawn so; who draws worlds puts their places
    behind those of the task's props."""

    @property
    def is_plain(self) -> bool:
        """Whether every face of a thing, and the whole sky, has one colour."""
        is_shaded = bool(torch.as_tensor(0 if self.shadows is None else self.shadows).any())
        return self.zenith is None and self.fog is None and not is_shaded and not self.textures

    def lights(self, num_worlds: int) -> dict[str, Tensor]:
        """Those that are given, of each world, by name; directions have length 1.

        Args:
            num_worlds: As many as it has.

        Returns:
            Shapes: (num_worlds, 3), float64.
        """
        given = {name: getattr(self, name) for name in _LIGHTS}
        lights = {name: each(v, num_worlds) for name, v in given.items() if v is not None}
        if "sun_direction" in lights:
            direction = lights["sun_direction"]
            lights["sun_direction"] = direction / direction.norm(dim=-1, keepdim=True)
        return lights

    def over(self, other: "Appearance | None") -> "Appearance":
        """The same, with what it does not give taken from another."""
        if other is None:
            return self
        own = {f.name: getattr(self, f.name) for f in dataclasses.fields(self)}
        given = {name: value for name, value in own.items() if value is not None}
        for name in ("colors", "textures"):
            given[name] = {**getattr(other, name), **own[name]}
        return dataclasses.replace(other, **given)

    def __getitem__(self, worlds: slice | Tensor) -> "Appearance":
        """Returns that of some worlds."""
        return _cut(self, worlds)


def each(value: Several, num_worlds: int) -> Tensor:
    """One value for each world. Shape: (num_worlds, 3), float64."""
    return torch.as_tensor(value, dtype=torch.float64).expand(num_worlds, 3)


def each_number(value: Numbers, num_worlds: int) -> Tensor:
    """The same of numbers. Shape: (num_worlds,), float64."""
    return torch.as_tensor(value, dtype=torch.float64).expand(num_worlds)


_NUMBERS = frozenset({"fog", "shadows", "exposure", "size", "choice", "zoom"})
_OF_BESIDE = {"places": 2, "sizes": 1, "colors": 2}
"""Dimensions of what is one for all worlds."""


def _cut(value: Any, worlds: slice | Tensor, shared: int = 1) -> Any:
    """What some worlds have of anything; a tensor of at most so many dimensions is for all."""
    if isinstance(value, Mapping):
        return {meaning: _cut(of, worlds) for meaning, of in value.items()}
    if isinstance(value, Beside):
        return Beside(**{n: _cut(v, worlds, _OF_BESIDE[n]) for n, v in vars(value).items()})
    if isinstance(value, Appearance | Texture | Mounting):
        given = vars(value).items()
        return type(value)(**{n: _cut(v, worlds, 0 if n in _NUMBERS else 1) for n, v in given})
    return value[worlds] if isinstance(value, Tensor) and value.dim() > shared else value
