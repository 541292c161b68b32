"""AirSim's settings.json: vehicles, cameras, clock, wind and server.

The file may have single quotes, comments and trailing commas, as in the chapter's listings. Keys
that this package does not know are ignored; those that are like known ones are warned about.
"""

import dataclasses
import json
import logging
import math
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from drone_rl.flight.airsim.recording import RECORDED, RECORDING, RecordingChoice, read_choice
from drone_rl.flight.image_types import ImageType
from drone_rl.sim.coordinates import HOME, GeoPoint
from drone_rl.sim.entities import find_camera
from drone_rl.utils.errors import InputError, did_you_mean
from drone_rl.utils.files import read_bytes
from drone_rl.utils.schema import Flag, OneOf, Real, Text, Whole, shown

_log = logging.getLogger(__name__)

PORT, ADDRESS = 41451, "127.0.0.1"
SIM_MODES = ("Multirotor", "ComputerVision")
FLYING, POSING, PX4 = "SimpleFlight", "ComputerVision", "PX4Multirotor"
"""Vehicle types: with dynamics and SimpleFlight's controller, without dynamics, and of PX4."""
MAX_BYTES = 2**20
_TYPES = (FLYING, POSING, PX4)
_STATES = ("Armed", "Disarmed")
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


@dataclasses.dataclass(frozen=True)
class Capture:
    """Size and field of view of images of one type from one camera."""

    width: int = 256
    """Pixels."""
    height: int = 144
    fov: float = 90.0
    """Horizontal, degrees."""


@dataclasses.dataclass(frozen=True)
class Offset:
    """A pose in NED; metres and degrees. NaN components keep what is there."""

    x: float = math.nan
    y: float = math.nan
    z: float = math.nan
    roll: float = math.nan
    pitch: float = math.nan
    yaw: float = math.nan


@dataclasses.dataclass(frozen=True)
class CameraChoice:
    """Where a camera is mounted, relative to the vehicle, and its images."""

    offset: Offset = Offset()
    captures: Mapping[ImageType, Capture] = dataclasses.field(default_factory=dict)
    """By type, where they differ from the defaults."""


@dataclasses.dataclass(frozen=True)
class VehicleChoice:
    """A vehicle to create."""

    name: str
    kind: str = FLYING
    """One of SimpleFlight, ComputerVision and PX4Multirotor."""
    start: Offset = Offset()
    """Start pose in the world."""
    is_armed: bool = True
    has_api_control: bool = False
    cameras: Mapping[str, CameraChoice] = dataclasses.field(default_factory=dict)
    """By our names of cameras."""


@dataclasses.dataclass(frozen=True)
class AirsimSettings:
    """Content of a settings file."""

    sim_mode: str = SIM_MODES[0]
    address: str = ADDRESS
    port: int = PORT
    clock_speed: float = 1.0
    """Simulated seconds per second of real time."""
    home: GeoPoint = HOME
    """Place on Earth of the world's origin."""
    wind: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Metres per second, NED."""
    captures: Mapping[ImageType, Capture] = dataclasses.field(default_factory=dict)
    """Of all cameras, by type."""
    vehicles: tuple[VehicleChoice, ...] = ()
    segmentation: str = "CommonObjectsRandomIDs"
    """How segmentation ids are assigned at the start; "None" for 0 everywhere."""
    recording: RecordingChoice = dataclasses.field(default_factory=RecordingChoice)
    text: str = "{}"
    """The file, as JSON."""


_NUMBER = Real(-1e9, 1e9)
_POSE = dict.fromkeys(("X", "Y", "Z", "Roll", "Pitch", "Yaw"), _NUMBER)
_CAPTURE = {
    "ImageType": Whole(-1, 9),
    "Width": Whole(1, 4096),
    "Height": Whole(1, 4096),
    "FOV_Degrees": Real(1.0, 170.0),
}
_CAMERA = {**_POSE, "CaptureSettings": [_CAPTURE]}
_VEHICLE = {
    **_POSE,
    "VehicleType": OneOf(_TYPES, also=("ArduCopter", "PhysXCar", "ArduRover")),
    "DefaultVehicleState": OneOf(_STATES, also=("",)),
    "AutoCreate": Flag(),
    "AllowAPIAlways": Flag(),
    "Cameras": {"": _CAMERA},
}
_FILE = {
    "SettingsVersion": _NUMBER,
    "SimMode": OneOf(SIM_MODES, also=("Car", "car", "")),
    "UsageScenario": Text(),
    "ApiServerPort": Whole(0, 65535),
    "ApiServerEndpoint": Text(),  # unused
    "LocalHostIp": Text(),
    "ClockSpeed": Real(0.0, 1000.0, is_above=True),
    "ClockType": Text(),  # unused
    "OriginGeopoint": {
        "Latitude": Real(-90.0, 90.0),
        "Longitude": Real(-180.0, 180.0),
        "Altitude": Real(-1000.0, 10_000.0),
    },
    "Wind": dict.fromkeys(("X", "Y", "Z"), Real(-50.0, 50.0)),
    "CameraDefaults": _CAMERA,
    "Vehicles": {"": _VEHICLE},
    "Recording": {**RECORDING, "Cameras": [RECORDED]},
    "SegmentationSettings": {"InitMethod": OneOf(("CommonObjectsRandomIDs", "None"), also=("",))},
}
"""Keys of the file, with the kinds of their values; "" is any key, a list has one kind of items."""


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
            return dataclasses.replace(settings, address=ADDRESS)
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
    settings = _read(_FILE, data, "", name) or {}
    if settings.get("SimMode", "").lower() == "car":
        raise InputError(f"{name}: SimMode=Car is not supported; give {' or '.join(SIM_MODES)}")
    scenario = settings.get("UsageScenario", "")
    posed = "ComputerVision" in (scenario, settings.get("SimMode"))
    mode = SIM_MODES[1] if posed else SIM_MODES[0]
    defaults = settings.get("CameraDefaults", {})
    vehicles = [
        _vehicle(vehicle, values, mode, name)
        for vehicle, values in settings.get("Vehicles", {}).items()
        if values.get("AutoCreate", True)
    ]
    default = VehicleChoice(_kind(mode), _kind(mode))
    origin, wind = settings.get("OriginGeopoint", {}), settings.get("Wind", {})
    return AirsimSettings(
        sim_mode=mode,
        address=settings.get("LocalHostIp") or ADDRESS,
        port=settings.get("ApiServerPort", PORT),
        clock_speed=float(settings.get("ClockSpeed", 1.0)),
        home=GeoPoint(
            float(origin.get("Latitude", HOME.latitude)),
            float(origin.get("Longitude", HOME.longitude)),
            float(origin.get("Altitude", HOME.altitude)),
        ),
        wind=(float(wind.get("X", 0)), float(wind.get("Y", 0)), float(wind.get("Z", 0))),
        captures=_captures(defaults),
        vehicles=tuple(vehicles) or (default,),
        segmentation=settings.get("SegmentationSettings", {}).get("InitMethod")
        or AirsimSettings.segmentation,
        recording=read_choice(settings.get("Recording", {}), name),
        text=json.dumps(data),
    )


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


def _read(kind: Any, value: Any, where: str, name: str) -> Any:
    """Return a value of a kind, or of a table of kinds, without keys that mean nothing here.

    None stands for null and NaN, which mean the default. Keys like known ones are warned about; a
    wrong value is an `InputError` with the key's path.
    """
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return None
    path = f"{name}: {where or 'the file'}"
    if isinstance(kind, list):
        if not isinstance(value, list):
            raise InputError(f"{path} is not a list; write [...]")
        return [_read(kind[0], item, f"{where}[{i}]", name) or {} for i, item in enumerate(value)]
    if not isinstance(kind, Mapping):
        return kind.read(value, path)
    if not isinstance(value, Mapping):
        raise InputError(f"{path} is not an object; write {{...}}")
    return _read_table(kind, value, where, name)


def _read_table(
    kind: Mapping[str, Any], value: Mapping[str, Any], where: str, name: str
) -> dict[str, Any]:
    table: dict[str, Any] = {}
    for key, item in value.items():
        inner = f"{where}.{key}" if where else key
        if key in kind or "" in kind:
            content = _read(kind.get(key) or kind[""], item, inner, name)
            if content is not None:
                table[key] = content
        elif meant := did_you_mean(key, kind):
            _log.warning("%s: %s is unknown and ignored%s", name, inner, meant)
    return table


def _kind(mode: str) -> str:
    return FLYING if mode == SIM_MODES[0] else POSING


def _vehicle(vehicle: str, settings: Mapping[str, Any], mode: str, name: str) -> VehicleChoice:
    kind = settings.get("VehicleType") or _kind(mode)
    if kind not in _TYPES:
        raise InputError(
            f"{name}: Vehicles.{vehicle}.VehicleType={kind} is not supported; give one of "
            f"{', '.join(_TYPES)}"
        )
    if kind == PX4:
        _log.warning(
            "%s: Vehicles.%s.VehicleType=%s: there is no PX4; SimpleFlight's controller flies it",
            *(name, vehicle, kind),
        )
    cameras: dict[str, CameraChoice] = {}
    for camera, values in settings.get("Cameras", {}).items():
        try:
            spec = find_camera(camera)
        except InputError as error:
            raise InputError(f"{name}: Vehicles.{vehicle}.Cameras.{camera}: {error}") from error
        cameras[spec.name] = CameraChoice(_offset(values), _captures(values))
    return VehicleChoice(
        name=vehicle,
        kind=POSING if mode == SIM_MODES[1] else kind,
        start=_offset(settings),
        is_armed=settings.get("DefaultVehicleState") != "Disarmed",
        has_api_control=bool(settings.get("AllowAPIAlways", False)),
        cameras=cameras,
    )


def _offset(settings: Mapping[str, Any]) -> Offset:
    return Offset(*(float(settings.get(key, math.nan)) for key in _POSE))


def _captures(settings: Mapping[str, Any]) -> dict[ImageType, Capture]:
    captures: dict[ImageType, Capture] = {}
    for item in settings.get("CaptureSettings", []):
        kind = item.get("ImageType", 0)
        kinds = (
            list(ImageType) if kind == -1 else [ImageType(kind)] if kind < len(ImageType) else []
        )
        for one in kinds:
            old = captures.get(one, Capture())
            captures[one] = Capture(
                item.get("Width") or old.width,
                item.get("Height") or old.height,
                float(item.get("FOV_Degrees") or old.fov),
            )
    return captures
