"""Settings of appearance; each value is fixed or a range that is sampled at every reset."""

import dataclasses
from collections.abc import Mapping
from typing import Annotated, Any

import pydantic
import yaml
from annotated_types import MaxLen
from pydantic_core import PydanticCustomError

from drone_rl.config.camera import FRONT, CameraSettings
from drone_rl.config.task import Color, ObjectRegion
from drone_rl.config.values import Fraction
from drone_rl.utils.errors import InputError, did_you_mean
from drone_rl.utils.schema import Annotation, Listed, Real, Several, Span, Text, Whole
from drone_rl.utils.settings import Settings, conf_dir

NumberOrRange = float | tuple[float, float]
"""A number, or a range that is sampled uniformly."""
ColorOrRange = Color | tuple[Color, Color]
"""Red, green, blue from 0 to 1, or a range of each."""
Triple = tuple[float, float, float]
TripleOrRange = Triple | tuple[Triple, Triple]
"""Three numbers, or a range of each."""
Names = str | tuple[str, ...]
"""A name or several; stored as a tuple."""
NO_TEXTURE = "none"
"""The name for no texture, which a list of textures to sample from may contain."""


@dataclasses.dataclass(frozen=True)
class ByName(Annotation):
    """The kind of a mapping from names to settings."""

    inside: type[Settings]

    @property
    def words(self) -> str:
        """See `Annotation`."""
        return "settings by name"

    @property
    def reason(self) -> str:
        """See `Annotation`; errors inside have reasons of their own."""
        return ""

    @property
    def hint(self) -> Any:
        """See `Annotation`."""
        return Annotated[dict[Annotated[str, Text(80)], self.inside], MaxLen(64)]


_Tint = Span(Several(Real(0.0, 1.0), 3, 3))
_Light = Span(Real(0.0, 10.0))
_Tile = Span(Real(0.05, 1000.0, unit="m"))
_Textures = Listed("texture", most=32)
_Place = Span(Several(Real(-10.0, 10.0, unit="m"), 3, 3))
_Turn = Span(Several(Real(-90.0, 90.0, unit="degrees"), 3, 3))


def _read_preset(name: str) -> dict[str, Any]:
    """Return the values of a file in conf/appearance; minimal are the defaults, without a file."""
    files = {path.stem: path for path in sorted((conf_dir() / "appearance").glob("*.yaml"))}
    if name == "minimal":
        return {}
    if name not in files:
        names = ("minimal", *files)
        reason = f"must be one of {', '.join(names)}{did_you_mean(name, names)}"
        raise PydanticCustomError("name", "{reason}", {"reason": reason})
    values = yaml.safe_load(files[name].read_text("utf-8"))
    return {**_read_preset(values.pop("defaults")[0]), **values}


class ObjectAppearance(Settings):
    """Color and texture of objects of a scene file; null for the file's own."""

    color: Annotated[ColorOrRange, _Tint] | None = None
    """Red, green, blue."""
    texture: Annotated[Names, _Textures] | None = None
    """Texture, or a list of them; the same values as for the ground."""
    tile: Annotated[NumberOrRange, _Tile] = 2.0
    """Edge length of a tile of the texture, in metres."""


class LightAppearance(Settings):
    """Strength and color of lights of a scene file."""

    strength: Annotated[NumberOrRange, _Light] = 1.0
    """Factor of the light that the file gives."""
    color: Annotated[ColorOrRange, _Tint] = (1.0, 1.0, 1.0)
    """Red, green, blue that this light is multiplied by."""


class AppearanceSettings(Settings):
    """Sun, sky, fog, colors, textures, distractors, and the mounting of the policy's camera.

    The defaults are the tasks' own appearance.
    """

    sun_elevation: Annotated[NumberOrRange, Span(Real(1.0, 90.0, unit="degrees"))] = 55.2
    """Height of the sun above the horizon, in degrees."""
    sun_azimuth: Annotated[NumberOrRange, Span(Real(-360.0, 360.0, unit="degrees"))] = 127.9
    """Direction of the sun in degrees: 0 is straight ahead, 90 to the left."""
    sun_strength: Annotated[NumberOrRange, _Light] = 0.75
    """Sunlight on a surface that faces the sun; its sum with ambient light should be about 1."""
    sun_color: Annotated[ColorOrRange, _Tint] = (1.0, 1.0, 1.0)
    """Red, green, blue of the sun's light."""
    ambient_strength: Annotated[NumberOrRange, _Light] = 0.35
    """Ambient light, equal from all directions."""
    shadows: Fraction = 0.0
    """Probability that the sun casts shadows in an episode."""
    sky_horizon: Annotated[ColorOrRange, _Tint] = (0.62, 0.74, 0.92)
    """Color of the sky at the horizon, and of fog."""
    sky_zenith: Annotated[ColorOrRange, _Tint] | None = None
    """Color of the sky overhead; null for that of the horizon."""
    fog_visibility: (
        Annotated[NumberOrRange, Span(Real(0.0, 100_000.0, is_above=True, unit="m"))] | None
    ) = None
    """Distance at which fog reduces contrast to 5%, in metres; null for clear air."""
    ground_color: Annotated[ColorOrRange, _Tint] = (0.5, 0.54, 0.48)
    """Color of the ground."""
    object_color: Annotated[ColorOrRange, _Tint] | None = None
    """Color of targets and obstacles; null for the task's own."""
    ground_texture: Annotated[Names, _Textures] | None = None
    """Texture of the ground: checker, grid, bricks, noise, an image file, or a list of these and
    none (no texture), each equally likely; null for no texture."""
    ground_tile: Annotated[NumberOrRange, _Tile] = 4.0
    """Edge length of a tile of the ground texture, in metres."""
    object_texture: Annotated[Names, _Textures] | None = None
    """Texture of targets and obstacles; the same values as for the ground."""
    object_tile: Annotated[NumberOrRange, _Tile] = 2.0
    """Edge length of a tile of the object texture, in metres."""
    distractors: Annotated[int | tuple[int, int], Span(Whole(0, 64, "distractors"))] = 0
    """Number of distractors: boxes, balls and cylinders to the sides."""
    distractor_size: Annotated[NumberOrRange, Span(Real(0.1, 50.0, unit="m"))] = (1.0, 4.0)
    """Edge length or diameter of each distractor, in metres."""
    distractor_color: Annotated[ColorOrRange, _Tint] | None = None
    """Color of each distractor; null for six colors in turn."""
    distractor_distance: Annotated[NumberOrRange, Span(Real(0.1, 200.0, unit="m"))] = (2.0, 14.0)
    """Lateral distance of each distractor from the area of targets and obstacles, in metres."""
    camera_offset: Annotated[TripleOrRange, _Place] = (0.0, 0.0, 0.0)
    """Offset of the policy's camera from its default place: forward, left, up, in metres."""
    camera_turn: Annotated[TripleOrRange, _Turn] = (0.0, 0.0, 0.0)
    """Roll, pitch, yaw of the camera in degrees; positive: right side down, nose down, left."""
    camera_widening: Annotated[NumberOrRange, Span(Real(-160.0, 160.0, unit="degrees"))] = 0.0
    """Degrees added to `camera.horizontal_fov`; negative values narrow the field of view."""
    exposure: Annotated[NumberOrRange, Span(Real(0.01, 100.0))] = 1.0
    """Factor by which the camera multiplies all colors."""
    objects: Annotated[Mapping[str, ObjectAppearance], ByName(ObjectAppearance)] | None = None
    """Color and texture of objects of a scene file by name, as in
    {wall*: {color: [[0, 0, 0], [1, 1, 1]], texture: [bricks, none]}}: names of geoms, bodies or
    materials, where * stands for any text; null for none."""
    lights: Annotated[Mapping[str, LightAppearance], ByName(LightAppearance)] | None = None
    """Strength and color of lights of a scene file by name, as in {lamp*: {strength: [0.5, 1.5]}};
    the light at the camera is headlight; null for none."""

    @pydantic.model_validator(mode="before")
    @classmethod
    def _from_name(cls, data: Any) -> Any:
        return _read_preset(data) if isinstance(data, str) else data

    @property
    def is_minimal(self) -> bool:
        """Whether this is the default appearance."""
        return self == MINIMAL

    @property
    def varies(self) -> bool:
        """Whether it differs between episodes: a value is sampled, or distractors are placed."""
        values = {n: v for n, v in self if not n.startswith("distractor")}
        objects, lights = self.objects or {}, self.lights or {}
        named = [*objects.values(), *lights.values()]
        every = [*values.values(), *(value for one in named for _, value in one)]
        textures = (
            self.ground_texture,
            self.object_texture,
            *(one.texture for one in objects.values()),
        )
        return (
            any(_is_range(value) for value in every)
            or any(len(names or ()) > 1 for names in textures)
            or 0.0 < self.shadows < 1.0
            or _ends(self.distractors)[1] > 0
        )


MINIMAL = AppearanceSettings()
"""The default appearance."""


_LEAST_HEIGHT = 0.05
"""Minimum height of the camera in metres; any lower, images would show through the ground."""
_NARROWEST, _WIDEST = 1.0, 170.0
"""Degrees; see `CameraSettings.horizontal_fov`."""


def check_appearance(
    settings: AppearanceSettings,
    camera: CameraSettings,
    region: ObjectRegion | None,
    task: str,
    has_scene: bool = False,
) -> None:
    """Check that appearance, camera and object positions (None if unknown) are compatible.

    `has_scene`: whether the task takes place in scene files.

    Raises:
        InputError: Distractors can't be placed, the camera starts inside an object, or its field of
            view is too wide or narrow.
    """
    fov = camera.horizontal_fov
    for widening in _ends(settings.camera_widening):
        if not _NARROWEST <= fov + widening <= _WIDEST:
            raise InputError(
                f"appearance.camera_widening={widening:g} makes a field of view of "
                f"{fov + widening:g} degrees; give {_NARROWEST - fov:g} to {_WIDEST - fov:g}"
            )
    _check_names(settings, task, has_scene)
    if region is None or has_scene:
        if _ends(settings.distractors)[1]:
            reason = "is in a scene file" if has_scene else "does not define object positions"
            raise InputError(
                f"appearance.distractors={_ends(settings.distractors)[1]}: task={task} {reason}, "
                "so distractors can't be placed; give distractors=0"
            )
        return
    (_, forward), (most_right, most_left), (lowest, _) = low_and_high(settings.camera_offset)
    if region.altitude + lowest < _LEAST_HEIGHT:
        raise InputError(
            f"appearance.camera_offset={lowest:g} up puts the camera into the ground; give "
            f"{_LEAST_HEIGHT - region.altitude:g} or more"
        )
    aside = max(most_left, -most_right)
    reach = region.room - FRONT[0]
    if forward >= reach:
        raise InputError(
            f"appearance.camera_offset={forward:g} forward puts the camera into the first object; "
            f"give less than {reach:g}"
        )
    limit = region.bound + _ends(settings.distractor_distance)[0]
    if _ends(settings.distractors)[1] and aside >= limit:
        raise InputError(
            f"appearance.camera_offset={aside:g} sideways puts the camera into a distractor; give "
            f"less than {limit:g}, or a greater distractor_distance"
        )


def _check_names(settings: AppearanceSettings, task: str, has_scene: bool) -> None:
    for name in () if has_scene else {**(settings.objects or {}), **(settings.lights or {})}:
        raise InputError(
            f"appearance: {name!r} is named in a scene file, and task={task} has none; give "
            "task.scene=FILE, or leave appearance.objects and appearance.lights out"
        )


def _is_range(value: Any) -> bool:
    is_pair = isinstance(value, tuple) and len(value) == 2 and not isinstance(value[0], str)
    return is_pair and value[0] != value[1]


def _ends(value: Any) -> tuple[float, float]:
    """Return the lowest and the highest value."""
    return value if isinstance(value, tuple) else (value, value)


def low_and_high(value: Any) -> list[tuple[float, float]]:
    """Return the lowest and the highest value of each of three numbers."""
    low, high = value if isinstance(value[0], tuple) else (value, value)
    return [*zip(low, high, strict=True)]
