"""Settings of appearance; each value is fixed, or a range that is sampled at every reset."""

from typing import Annotated, Any

from drone_rl.config.camera import FRONT, CameraSettings
from drone_rl.config.task import Color, Things
from drone_rl.utils.errors import InputError
from drone_rl.utils.schema import Listed, Real, Several, Span, Whole
from drone_rl.utils.settings import Settings

Number = float | tuple[float, float]
"""A number, or a range in which every one is as likely."""
Tint = Color | tuple[Color, Color]
"""Red, green, blue from 0 to 1, or a range of each."""
Triple = tuple[float, float, float]
Triples = Triple | tuple[Triple, Triple]
"""Three numbers, or a range of each."""
Names = str | tuple[str, ...]
"""A name or several; kept as several."""
NO_TEXTURE = "none"
"""The name that stands for no texture, among others from which one is drawn."""

_Tint = Span(Several(Real(0.0, 1.0), 3, 3))
_Light = Span(Real(0.0, 10.0))
_Tile = Span(Real(0.05, 1000.0, unit="m"))
_Textures = Listed("texture", most=32)
_Place = Span(Several(Real(-10.0, 10.0, unit="m"), 3, 3))
_Turn = Span(Several(Real(-90.0, 90.0, unit="degrees"), 3, 3))


class AppearanceSettings(Settings):
    """Sun, sky, fog, colours, textures, distractors, and the mounting of the policy's camera.

    The defaults are the tasks' own appearance.
    """

    sun_elevation: Annotated[Number, Span(Real(1.0, 90.0, unit="degrees"))] = 55.2
    """Height of the sun above the horizon, in degrees."""
    sun_azimuth: Annotated[Number, Span(Real(-360.0, 360.0, unit="degrees"))] = 127.9
    """Where the sun stands: 0 is straight ahead, 90 to the left, in degrees."""
    sun_strength: Annotated[Number, _Light] = 0.75
    """Light of the sun on what faces it; with the ambient light's it should be about 1."""
    sun_color: Annotated[Tint, _Tint] = (1.0, 1.0, 1.0)
    """Red, green, blue of the sun's light."""
    ambient_strength: Annotated[Number, _Light] = 0.35
    """Light from everywhere."""
    shadows: Annotated[float, Real(0.0, 1.0)] = 0.0
    """Fraction of episodes in which the sun casts shadows."""
    sky_horizon: Annotated[Tint, _Tint] = (0.62, 0.74, 0.92)
    """Colour of the sky at the horizon, and of fog."""
    sky_zenith: Annotated[Tint, _Tint] | None = None
    """Colour of the sky overhead; none for that of the horizon."""
    fog_visibility: (
        Annotated[Number, Span(Real(0.0, 100_000.0, is_above=True, unit="m"))] | None
    ) = None
    """Distance at which fog leaves 5% of a contrast, in metres; none for clear air."""
    ground_color: Annotated[Tint, _Tint] = (0.5, 0.54, 0.48)
    """Colour of the ground."""
    object_color: Annotated[Tint, _Tint] | None = None
    """Colour of targets and obstacles; none for the task's own."""
    ground_texture: Annotated[Names, _Textures] | None = None
    """Texture of the ground: checker, grid, bricks, noise, an image file, or a list of these and
    none, each equally likely."""
    ground_tile: Annotated[Number, _Tile] = 4.0
    """Edge of a tile of it, in metres."""
    object_texture: Annotated[Names, _Textures] | None = None
    """The same of targets and obstacles."""
    object_tile: Annotated[Number, _Tile] = 2.0
    """Edge of a tile of it, in metres."""
    distractors: Annotated[int | tuple[int, int], Span(Whole(0, 64, "distractors"))] = 0
    """Number of distractors: boxes, balls and cylinders to the sides."""
    distractor_size: Annotated[Number, Span(Real(0.1, 50.0, unit="m"))] = (1.0, 4.0)
    """Edge or diameter of each, in metres."""
    distractor_color: Annotated[Tint, _Tint] | None = None
    """Colour of each; none for one of six, in turn."""
    distractor_distance: Annotated[Number, Span(Real(0.1, 200.0, unit="m"))] = (2.0, 14.0)
    """How far each is from where targets and obstacles may stand, to the side, in metres."""
    camera_offset: Annotated[Triples, _Place] = (0.0, 0.0, 0.0)
    """Offset of the policy's camera from its default place: forward, left, up, in metres."""
    camera_turn: Annotated[Triples, _Turn] = (0.0, 0.0, 0.0)
    """How it is turned there: roll (to the right), pitch (down) and yaw (to the left), degrees."""
    camera_widening: Annotated[Number, Span(Real(-160.0, 160.0, unit="degrees"))] = 0.0
    """By how much its horizontal field of view is wider than that of the camera's settings, in
    degrees."""
    exposure: Annotated[Number, Span(Real(0.01, 100.0))] = 1.0
    """Factor of the camera on all colours."""

    @property
    def is_minimal(self) -> bool:
        """Whether this is the default appearance."""
        return self == MINIMAL


MINIMAL = AppearanceSettings()
"""The default appearance."""


_LEAST_HEIGHT = 0.05
"""Metres above the ground, below which the camera would see through it."""
_NARROWEST, _WIDEST = 1.0, 170.0
"""Degrees; see `CameraSettings.horizontal_fov`."""


def check_appearance(
    settings: AppearanceSettings, camera: CameraSettings, things: Things | None, task: str
) -> None:
    """Check appearance, camera and positions of a task's things (None if unknown) together.

    Raises:
        InputError: Distractors have no place, the camera starts inside an object, or its field of
            view is too wide or narrow.
    """
    own = camera.horizontal_fov
    for widening in _ends(settings.camera_widening):
        if not _NARROWEST <= own + widening <= _WIDEST:
            raise InputError(
                f"appearance.camera_widening={widening:g} makes a field of view of "
                f"{own + widening:g} degrees; give {_NARROWEST - own:g} to {_WIDEST - own:g}"
            )
    if things is None:
        if _ends(settings.distractors)[1]:
            raise InputError(
                f"appearance.distractors={_ends(settings.distractors)[1]}: task={task} does not "
                "say where its things stand, so nothing can stand beside them; give distractors=0"
            )
        return
    (_, forward), (most_right, most_left), (lowest, _) = _sides(settings.camera_offset)
    if things.altitude + lowest < _LEAST_HEIGHT:
        raise InputError(
            f"appearance.camera_offset={lowest:g} up puts the camera into the ground; give "
            f"{_LEAST_HEIGHT - things.altitude:g} or more"
        )
    aside = max(most_left, -most_right)
    reach = things.first - things.size / 2 - FRONT[0]
    if forward >= reach:
        raise InputError(
            f"appearance.camera_offset={forward:g} forward puts the camera into the first thing "
            f"that stands there; give less than {reach:g}"
        )
    limit = things.bound + _ends(settings.distractor_distance)[0]
    if _ends(settings.distractors)[1] and aside >= limit:
        raise InputError(
            f"appearance.camera_offset={aside:g} aside puts the camera into a distractor; give "
            f"less than {limit:g}, or a greater distractor_distance"
        )


def _ends(value: Any) -> tuple[float, float]:
    """Lowest and highest value."""
    return value if isinstance(value, tuple) else (value, value)


def _sides(value: Any) -> list[tuple[float, float]]:
    """Lowest and highest value of each of three."""
    low, high = value if isinstance(value[0], tuple) else (value, value)
    return [*zip(low, high, strict=True)]
