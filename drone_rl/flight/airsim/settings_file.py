"""AirSim's settings.json: vehicles, cameras, clock, wind and server.

The file may have single quotes, comments and trailing commas, as in the chapter's listings. Keys
that this package does not use are ignored, with a warning.
"""

import functools
import json
import logging
import math
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple

import pydantic
from pydantic import Field
from pydantic.alias_generators import to_pascal

from drone_rl.flight.image_types import ImageType
from drone_rl.sim.coordinates import HOME, GeoPoint
from drone_rl.sim.entities import find_camera
from drone_rl.utils.errors import InputError, did_you_mean
from drone_rl.utils.files import read_bytes
from drone_rl.utils.models import Model
from drone_rl.utils.schema import shown

_log = logging.getLogger(__name__)

PORT, ADDRESS = 41451, "127.0.0.1"
FLYING, POSING, PX4 = "SimpleFlight", "ComputerVision", "PX4Multirotor"
"""Vehicle types: with dynamics and SimpleFlight's controller, without dynamics, and of PX4."""
MAX_BYTES = 2**20
_USUAL = ("SettingsVersion", "SimMode", "Vehicles")
"""Keys by which a file is recognized as AirSim's."""
_COMMENT = r"//[^\n]*(?![^\n])|/\*(?:(?!\*/).)*(?:\*/|\Z)"
"""Matches one comment in one way only, an open one to the end, so that no search is repeated."""
_TOKEN = re.compile(
    rf"""(?P<comment>{_COMMENT})"""
    r"""|(?P<text>"(?:\\.|[^"\\])*(?:"|\\?\Z)|'(?:\\.|[^'\\])*(?:'|\\?\Z))"""
    rf"""|(?P<comma>,(?=(?:\s|{_COMMENT})*[}}\]]))|(?P<other>.)""",
    re.DOTALL,
)


class Capture(NamedTuple):
    """Size and field of view of images of one type from one camera."""

    width: int = 256
    """Pixels."""
    height: int = 144
    fov: float = 90.0
    """Horizontal, degrees."""


class _Section(Model):
    """A part of the file with AirSim's keys, in which null, NaN and "" mean the default."""

    model_config = pydantic.ConfigDict(
        extra="ignore", strict=True, alias_generator=to_pascal, validate_by_name=True
    )

    @pydantic.model_validator(mode="before")
    @classmethod
    def _known(cls, data: Any) -> Any:
        if not isinstance(data, Mapping):
            return data
        names = [str(field.alias) for field in cls.model_fields.values()]
        for key in data:
            if key not in (*names, *cls.model_fields):
                _log.warning("settings: %s has no effect here%s", key, did_you_mean(key, names))
        return {k: v for k, v in data.items() if v not in (None, "") and v == v}


_Coordinate = Annotated[float, Field(ge=-1e9, le=1e9)]
_Pixels = Annotated[int, Field(ge=1, le=4096)]
_Degrees = Annotated[float, Field(ge=1.0, le=170.0)]
_Wind = Annotated[float, Field(ge=-50.0, le=50.0)]


class Offset(_Section):
    """A pose in NED; metres and degrees. NaN components keep what is there."""

    x: _Coordinate = math.nan
    y: _Coordinate = math.nan
    z: _Coordinate = math.nan
    roll: _Coordinate = math.nan
    pitch: _Coordinate = math.nan
    yaw: _Coordinate = math.nan

    @property
    def position(self) -> tuple[float, float, float]:
        """Metres."""
        return self.x, self.y, self.z

    @property
    def angles(self) -> tuple[float, float, float]:
        """Roll, pitch and yaw, degrees."""
        return self.roll, self.pitch, self.yaw


class _CaptureSettings(_Section):
    image_type: Annotated[int, Field(ge=-1, le=9)] = 0
    width: _Pixels | None = None
    height: _Pixels | None = None
    fov: Annotated[_Degrees | None, Field(alias="FOV_Degrees")] = None


class CameraChoice(Offset):
    """Where a camera is mounted, relative to the vehicle, and its images."""

    capture_settings: list[_CaptureSettings] = Field(default_factory=list)

    @property
    def captures(self) -> dict[ImageType, Capture]:
        """Images by type, where they differ from the defaults."""
        captures: dict[ImageType, Capture] = {}
        for item in self.capture_settings:
            for kind in ImageType:
                if item.image_type in (-1, kind):
                    changes = item.model_dump(exclude={"image_type"}, exclude_none=True)
                    captures[kind] = captures.get(kind, Capture())._replace(**changes)
        return captures


class VehicleChoice(Offset):
    """A vehicle to create, and its start pose in the world."""

    vehicle_type: str = ""
    """SimpleFlight, ComputerVision or PX4Multirotor; "" for that of the simulation's mode."""
    default_vehicle_state: Literal["Armed", "Disarmed"] = "Armed"
    auto_create: bool = True
    has_api_control: Annotated[bool, Field(alias="AllowAPIAlways")] = False
    cameras: dict[str, CameraChoice] = Field(default_factory=dict)
    """By our names of cameras."""

    @pydantic.field_validator("cameras")
    @classmethod
    def _named(cls, cameras: dict[str, CameraChoice]) -> dict[str, CameraChoice]:
        return {find_camera(name).name: camera for name, camera in cameras.items()}


class RecordedImage(_Section):
    """An image in each row of a recording."""

    label: Annotated[str, Field(alias="CameraName")] = "0"
    """The camera as the file calls it."""
    image_type: Annotated[int, Field(ge=0, lt=len(ImageType))] = 0
    as_float: Annotated[bool, Field(alias="PixelsAsFloat")] = False
    compress: bool = True
    vehicle_name: str | None = None
    """Its vehicle; None for the first one."""

    @pydantic.field_validator("label")
    @classmethod
    def _exists(cls, label: str) -> str:
        find_camera(label)
        return label


class RecordingChoice(_Section):
    """Which rows and images recordings have."""

    record_on_move: bool = False
    """Whether rows of vehicles that have not moved are left out."""
    record_interval: Annotated[float, Field(ge=0.0, le=1e6)] = 0.05
    """Mean simulated seconds between two rows, which are whole control periods apart."""
    folder: str = ""
    """Folder; "" for that of the server."""
    enabled: bool = False
    """Whether to record from the start."""
    cameras: list[RecordedImage] | None = None
    """None for the scene in the front camera of each vehicle."""


class _Origin(_Section):
    latitude: Annotated[float, Field(ge=-90.0, le=90.0)] = HOME.latitude
    longitude: Annotated[float, Field(ge=-180.0, le=180.0)] = HOME.longitude
    altitude: Annotated[float, Field(ge=-1000.0, le=10_000.0)] = HOME.altitude


class _WindSettings(_Section):
    x: _Wind = 0.0
    y: _Wind = 0.0
    z: _Wind = 0.0


class _SegmentationSettings(_Section):
    init_method: Literal["CommonObjectsRandomIDs", "None"] = "CommonObjectsRandomIDs"


class AirsimSettings(_Section):
    """Content of a settings file."""

    settings_version: float | None = None
    sim_mode: Literal["Multirotor", "ComputerVision"] = "Multirotor"
    usage_scenario: str = ""
    address: Annotated[str, Field(alias="LocalHostIp")] = ADDRESS
    port: Annotated[int, Field(alias="ApiServerPort", ge=0, le=65535)] = PORT
    clock_speed: Annotated[float, Field(gt=0.0, le=1000.0)] = 1.0
    """Simulated seconds per second of real time."""
    origin_geopoint: _Origin = _Origin()
    wind: _WindSettings = _WindSettings()
    """Metres per second, NED."""
    camera_defaults: CameraChoice = CameraChoice()
    """Of all cameras; only its captures apply."""
    vehicles: dict[str, VehicleChoice] = Field(default_factory=dict)
    segmentation_settings: _SegmentationSettings = _SegmentationSettings()
    recording: RecordingChoice = RecordingChoice()
    text: str = "{}"
    """The file, as JSON."""

    @property
    def is_posing(self) -> bool:
        """Whether no vehicle has dynamics."""
        return POSING in (self.sim_mode, self.usage_scenario)

    @property
    def home(self) -> GeoPoint:
        """Place on Earth of the world's origin."""
        return GeoPoint(**self.origin_geopoint.model_dump())

    @functools.cached_property
    def choices(self) -> dict[str, VehicleChoice]:
        """The vehicles to create, with their types; one if the file has none."""
        usual, choices = POSING if self.is_posing else FLYING, dict[str, VehicleChoice]()
        for name, choice in self.vehicles.items():
            kind = choice.vehicle_type or usual
            if choice.auto_create and kind not in (FLYING, POSING, PX4):
                raise InputError(
                    f"Vehicles.{name}.VehicleType={kind} is not supported; give one of "
                    f"{FLYING}, {POSING}, {PX4}"
                )
            if choice.auto_create:
                kind = POSING if self.is_posing else kind
                choices[name] = choice.model_copy(update={"vehicle_type": kind})
            if choice.auto_create and kind == PX4:
                _log.warning(
                    "settings: Vehicles.%s.VehicleType=%s: there is no PX4; SimpleFlight's "
                    "controller flies it",
                    *(name, kind),
                )
        return choices or {usual: VehicleChoice(vehicle_type=usual)}

    @pydantic.model_validator(mode="after")
    def _check(self) -> "AirsimSettings":
        _ = self.choices
        return self


def find_settings() -> AirsimSettings | None:
    """Read settings.json of the working directory, else of ~/Documents/AirSim; None without.

    A file that is not AirSim's is ignored, and so is the address to listen at of one that is: the
    user has not named the file. Raises an `InputError` if a value is wrong.
    """
    for folder in (Path.cwd(), Path.home() / "Documents" / "AirSim"):
        path = folder / "settings.json"
        if path.is_file() and _is_of_airsim(path):
            try:
                settings = read_settings(path)
            except InputError as error:
                raise InputError(f"{error}; or give settings=FILE or settings=none") from error
            _log.info("settings: %s", path)
            if settings.address != ADDRESS:
                _log.warning(
                    "%s: LocalHostIp=%s is ignored; give settings=FILE or address=",
                    *(path, shown(settings.address)),
                )
            return settings.model_copy(update={"address": ADDRESS})
    return None


def _is_of_airsim(path: Path) -> bool:
    """Return whether a file is an object with a key of AirSim; log if not."""
    try:
        data = _load(_read_text(path), str(path))
    except InputError:
        data = None
    is_of_airsim = isinstance(data, Mapping) and not data.keys().isdisjoint(_USUAL)
    if not is_of_airsim:
        _log.warning("%s is ignored: it has none of %s", path, ", ".join(_USUAL))
    return is_of_airsim


def read_settings(path: Path) -> AirsimSettings:
    """Read a settings file.

    Raises:
        InputError: It can't be read, or a value is wrong; the message has the key's path.
    """
    return parse_settings(_read_text(path), str(path))


def _read_text(path: Path) -> str:
    try:
        return read_bytes(path, MAX_BYTES).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(f"settings={path} is not text in UTF-8; save it as UTF-8") from error


def parse_settings(text: str, name: str = "settings.json") -> AirsimSettings:
    """Read settings from the text of a file; see `read_settings` for errors."""
    data = _load(text, name)
    settings = AirsimSettings.read(data, name)
    return settings.model_copy(update={"text": json.dumps(data)})


def _load(text: str, name: str) -> Any:
    try:
        return json.loads("".join(_as_json(text)))
    except json.JSONDecodeError as error:
        raise InputError(
            f"{name}: line {error.lineno} is not JSON ({error.msg}); mend it there"
        ) from error
    except RecursionError as error:
        raise InputError(f"{name} is nested too deeply; give fewer levels") from error
    except ValueError as error:  # Python refuses to read more digits
        raise InputError(f"{name} has a number of too many digits; shorten it") from error


def _as_json(text: str) -> Iterator[str]:
    """Yield the text as JSON: without comments and trailing commas, with double quotes."""
    for match in _TOKEN.finditer(text):
        token = match.group()
        if match.lastgroup == "text" and token[0] == "'":
            inner = token[1:-1].replace("\\'", "'")
            yield '"' + re.sub(r'(?<!\\)"', r"\"", inner) + '"'
        elif match.lastgroup == "comment" and _is_closed(token):
            yield "\n" * token.count("\n")  # errors name lines of the file
        elif match.lastgroup != "comma":
            yield token


def _is_closed(comment: str) -> bool:
    return comment.startswith("//") or (len(comment) > 3 and comment.endswith("*/"))
