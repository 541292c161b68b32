"""Appearance of a scene: colors, light, textures, fog and camera mounting, per environment."""

import dataclasses
import math
from collections.abc import Mapping
from typing import Any

import torch
from torch import Tensor

from drone_rl.sim.rendering.scene import SemanticClass

Color = tuple[float, float, float]
"""Red, green, blue in [0, 1]."""
Colors = Color | Tensor
"""One for all environments, or one each: shape (num_envs, 3)."""
Scalars = float | Tensor
"""One for all environments, or one each: shape (num_envs,)."""
AXES = {"roll": (1.0, 0.0, 0.0), "pitch": (0.0, 1.0, 0.0), "yaw": (0.0, 0.0, 1.0)}
"""Axes that a camera rotates about, drone frame: x forward, y left, z up."""
_LIGHTS = ("ambient", "sun", "sun_direction")
AMBIENT = 0.35
"""Ambient light of the tasks' own scenes."""
SUN = 0.75
"""Their sunlight on a surface that faces the sun."""
SUN_DIRECTION = (0.35, -0.45, -0.82)
"""Direction in which it travels, world frame."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Mounting:
    """Changes of one camera's mounting; each value is one for all environments or one each."""

    camera: str = "drone/front_center"
    """Full name in the model; other cameras keep their mounting."""
    offset: tuple[float, ...] | Tensor = (0.0, 0.0, 0.0)
    """Metres, drone frame. Shape: (3,) or (num_envs, 3)."""
    turn: tuple[float, ...] | Tensor = (1.0, 0.0, 0.0, 0.0)
    """Rotation about the camera's position, drone frame: quaternion (w, x, y, z). Shape: (*, 4)."""
    zoom: float | Tensor | None = None
    """Magnification at the centre of the image. Shape: () or (num_envs,)."""


def moved(mounting: Mounting | None, offset: Tensor, turn: Tensor) -> Mounting:
    """Translate a camera, (num_envs, 3), metres, then rotate it about itself, (num_envs, 4).

    Both are in the drone frame as the mounting has turned it.
    """
    mounting = mounting or Mounting()
    before = torch.as_tensor(mounting.turn, dtype=offset.dtype).to(offset.device)
    there = torch.as_tensor(mounting.offset, dtype=offset.dtype).to(offset.device)
    return dataclasses.replace(
        mounting, offset=there + rotate(before, offset), turn=product(before, turn)
    )


def turned(axis: str, degrees: float | Tensor) -> Tensor:
    """Return quaternions of rotations about one of `AXES`. Shapes: (*) to (*, 4)."""
    half = torch.deg2rad(torch.as_tensor(degrees, dtype=torch.float64)) / 2
    around = half.new_tensor(AXES[axis])
    return torch.cat([half.cos()[..., None], half.sin()[..., None] * around], -1)


def zoom_for_fov(fov: float, wanted: Tensor) -> Tensor:
    """Return the `Mounting.zoom` for a wanted field of view. Degrees. Shape: (*)."""
    return math.tan(math.radians(fov) / 2) / torch.tan(torch.deg2rad(wanted) / 2)


def product(a: Tensor, b: Tensor) -> Tensor:
    """Multiply quaternions (w, x, y, z): b in the frame of a. Shapes: (*, 4)."""
    a, b = torch.broadcast_tensors(a, b)
    scalar = a[..., :1] * b[..., :1] - (a[..., 1:] * b[..., 1:]).sum(-1, keepdim=True)
    cross = torch.linalg.cross(a[..., 1:], b[..., 1:])
    return torch.cat([scalar, a[..., :1] * b[..., 1:] + b[..., :1] * a[..., 1:] + cross], -1)


def rotate(attitude: Tensor, vector: Tensor) -> Tensor:
    """Rotate vectors by quaternions. Shapes: (*, 4) and (*, 3)."""
    axis, vector = torch.broadcast_tensors(attitude[..., 1:], vector)
    twice = 2 * torch.linalg.cross(axis, vector)
    return vector + attitude[..., :1] * twice + torch.linalg.cross(axis, twice)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Texture:
    """A tiled texture; its colors are multiplied by those of the geoms."""

    images: tuple[str, ...]
    """Names or files that environments choose from, see `textures.load`."""
    size: Scalars
    """Edge of a tile, metres."""
    choice: Scalars = 0
    """Index of the image, a whole number; -1 for none."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class ObjectLook:
    """Changes to how some objects of a scene file look; None for what stays as in the file."""

    color: Colors | None = None
    texture: Texture | None = None


@dataclasses.dataclass(frozen=True, kw_only=True)
class Lamp:
    """Changes to lights of a scene file."""

    color: Colors
    """Factor of its color; may be above 1."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Distractors:
    """Distractors, the same for all environments or one set each."""

    places: Tensor
    """Positions, metres, world frame. Shape: (num_envs, count, 3) or (count, 3)."""
    sizes: Tensor
    """Edges or diameters, metres; in the model 1 m. Shape: (num_envs, count) or (count,)."""
    colors: Tensor
    """Shape: as that of `places`."""

    def expand(self, num_envs: int) -> "Distractors":
        """Return them with a first dimension of environments."""
        count = self.places.shape[-2]
        return Distractors(
            places=self.places.expand(num_envs, count, 3),
            sizes=self.sizes.expand(num_envs, count),
            colors=self.colors.expand(num_envs, count, 3),
        )

    def concat(self, other: "Distractors") -> "Distractors":
        """Append the distractors of another set with as many environments."""
        fields = vars(self.expand(len(other.places)))
        both = {name: torch.cat([v, getattr(other, name)], 1) for name, v in fields.items()}
        return Distractors(**both)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Appearance:
    """Changes to how a scene looks; what is not given stays as in the model.

    In scenes from files, `ambient` and `sun` are relative to `AMBIENT` and `SUN`, and change the
    light of all lamps; `sun_direction` is that of each file's first directional light.
    """

    colors: Mapping[SemanticClass, Colors] = dataclasses.field(default_factory=dict)
    """Of the geoms of a class, and of the sky."""
    ambient: Colors | None = None
    sun: Colors | None = None
    sun_direction: Colors | None = None
    """Direction in which the sun's light travels, world frame; need not have length 1."""
    zenith: Colors | None = None
    """Color of the sky overhead, blended with that of the horizon by the elevation's sine."""
    fog_visibility: Scalars | None = None
    """Metres: the distance at which 95% of the contrast to the horizon is lost
    (meteorological optical range, WMO-No. 8). Infinite for clear air."""
    shadows: Scalars | None = None
    """Whether solids cast shadows in sunlight: 1 or 0."""
    exposure: Scalars | None = None
    """Factor of all colors before they are clipped at white."""
    textures: Mapping[SemanticClass, Texture] = dataclasses.field(default_factory=dict)
    """Of the geoms of a class; the sky has none."""
    objects: Mapping[str, ObjectLook] = dataclasses.field(default_factory=dict)
    """Of objects of a scene file by the names of their geoms, bodies or materials; * stands for any
    text. Later ones take precedence."""
    lamps: Mapping[str, Lamp] = dataclasses.field(default_factory=dict)
    """Of lights of a scene file by name, as in `objects`."""
    camera: Mounting | None = None
    """How a camera differs from the model's."""
    distractors: Distractors | None = None
    """Their colors and sizes; the caller appends their positions to `Poses.props`."""

    @property
    def is_plain(self) -> bool:
        """Whether every face and the whole sky have one color: no effects."""
        is_shaded = bool(torch.as_tensor(0 if self.shadows is None else self.shadows).any())
        is_foggy, has_zenith = self.fog_visibility is not None, self.zenith is not None
        return not (has_zenith or is_foggy or is_shaded or self.textures)

    def lights(self, num_envs: int) -> dict[str, Tensor]:
        """Return the given lights by name, shapes (num_envs, 3); directions have length 1."""
        fields = {name: getattr(self, name) for name in _LIGHTS}
        lights = {name: expand_color(v, num_envs) for name, v in fields.items() if v is not None}
        if "sun_direction" in lights:
            direction = lights["sun_direction"]
            lights["sun_direction"] = direction / direction.norm(dim=-1, keepdim=True)
        return lights

    def over(self, other: "Appearance | None") -> "Appearance":
        """Return this appearance, completed by another where this one gives nothing."""
        if other is None:
            return self
        fields = {name: value for name, value in vars(self).items() if value is not None}
        for name in ("colors", "textures", "objects", "lamps"):
            fields[name] = {**getattr(other, name), **fields[name]}
        return dataclasses.replace(other, **fields)

    def __getitem__(self, worlds: slice | Tensor) -> "Appearance":
        return _select(self, worlds)


def expand_color(value: Colors, num_envs: int) -> Tensor:
    """Return one color or direction per environment. Shape: (num_envs, 3), float64."""
    return torch.as_tensor(value, dtype=torch.float64).expand(num_envs, 3)


def expand_scalar(value: Scalars, num_envs: int) -> Tensor:
    """Return one number per environment. Shape: (num_envs,), float64."""
    return torch.as_tensor(value, dtype=torch.float64).expand(num_envs)


_SHARED_DIMENSIONS = {
    **dict.fromkeys(("fog_visibility", "shadows", "exposure", "size", "choice", "zoom"), 0),
    **{"places": 2, "sizes": 1},
}
"""Dimensions of a field's tensor that is shared by all environments; 1 where not listed."""


def _select(value: Any, worlds: slice | Tensor, shared: int = 1) -> Any:
    """Select environments; a tensor of at most `shared` dimensions is kept whole."""
    if isinstance(value, Mapping):
        return {semantic_class: _select(of, worlds) for semantic_class, of in value.items()}
    if isinstance(value, Distractors | Appearance | Texture | Mounting | ObjectLook | Lamp):
        shares = {**_SHARED_DIMENSIONS, "colors": 2 if isinstance(value, Distractors) else 1}
        fields = {n: _select(v, worlds, shares.get(n, 1)) for n, v in vars(value).items()}
        return type(value)(**fields)
    return value[worlds] if isinstance(value, Tensor) and value.dim() > shared else value
