"""Recordings: the vehicles' poses and images over time, as AirSim records them."""

import contextlib
import dataclasses
import datetime
import io
import logging
import re
import zlib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from PIL import Image
from torch import Tensor

from drone_rl.flight.airsim.messages import Pose
from drone_rl.flight.image_types import ImageType
from drone_rl.sim.entities import find_camera
from drone_rl.utils.errors import InputError
from drone_rl.utils.schema import Flag, Real, Text, Whole

_log = logging.getLogger(__name__)

_COLUMNS = (
    "VehicleName TimeStamp POS_X POS_Y POS_Z Q_W Q_X Q_Y Q_Z ImageFile".replace(" ", "\t") + "\n"
)


@dataclasses.dataclass(frozen=True)
class RecordedImage:
    """An image in each row of a recording."""

    camera: str
    """One of our names of cameras."""
    label: str
    """The camera as the file calls it."""
    kind: ImageType
    as_float: bool
    compress: bool
    vehicle: str | None = None
    """Its vehicle; None for the first one."""


@dataclasses.dataclass(frozen=True)
class RecordingChoice:
    """Which rows and images recordings have."""

    on_move: bool = False
    """Whether rows of vehicles that have not moved are left out."""
    interval: float = 0.05
    """Mean simulated seconds between two rows, which are whole control periods apart."""
    folder: str = ""
    """Folder; "" for that of the server."""
    is_enabled: bool = False
    """Whether to record from the start."""
    images: tuple[RecordedImage, ...] | None = None
    """None for the scene in the front camera of each vehicle."""


RECORDING = {
    "RecordOnMove": Flag(),
    "RecordInterval": Real(0.0, 1e6),
    "Folder": Text(),
    "Enabled": Flag(),
}
"""Keys of AirSim's settings, and their kinds."""
RECORDED = {
    "CameraName": Text(),
    "ImageType": Whole(0, len(ImageType) - 1),
    "PixelsAsFloat": Flag(),
    "Compress": Flag(),
    "VehicleName": Text(),
}
"""Those of one image."""
_USUAL = (RecordedImage("front_center", "0", ImageType.SCENE, False, True),)
_ORIGIN = Pose((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))


def read_choice(settings: Mapping[str, Any], file: str) -> RecordingChoice:
    """Return the choice of settings with the keys of `RECORDING`, and a list `Cameras`.

    Raises an `InputError` that names the file if a camera is unknown.
    """
    try:
        images = [
            RecordedImage(
                find_camera(item.get("CameraName", "0")).name,
                item.get("CameraName", "0"),
                ImageType(item.get("ImageType", 0)),
                item.get("PixelsAsFloat", False),
                item.get("Compress", True),
                item.get("VehicleName"),
            )
            for item in settings.get("Cameras", [])
        ]
    except InputError as error:
        raise InputError(f"{file}: Recording.Cameras: {error}") from error
    return RecordingChoice(
        settings.get("RecordOnMove", False),
        float(settings.get("RecordInterval", RecordingChoice.interval)),
        settings.get("Folder", ""),
        settings.get("Enabled", False),
        tuple(images) if "Cameras" in settings else None,
    )


class Recording:
    """Writes `airsim_rec.txt` and `images/` to a new folder, named by date and time.

    numpy reads the table by `numpy.genfromtxt(path, names=True, dtype=None, encoding="utf-8")`.
    """

    def __init__(self, choice: RecordingChoice, folder: Path, begin: float) -> None:
        """Create the folder; rows are due from the simulated time `begin`, seconds.

        Raises an `InputError` if it can't be written.
        """
        now = datetime.datetime.now().strftime("%Y-%m-%d-%H-%M-%S-%f")
        self.choice, self.path = choice, folder / now
        try:
            (self.path / "images").mkdir(parents=True)
            self._table: io.TextIOWrapper = (self.path / "airsim_rec.txt").open(
                "w", encoding="utf-8"
            )
        except OSError as error:
            raise InputError(
                f"recordings can't be written to {folder} ({error.strerror}); choose another folder"
            ) from error
        self._table.write(_COLUMNS)
        self._next = begin
        self._poses: dict[str, Pose] = {}

    def take_turn(self, time: float) -> bool:
        """Return whether rows of this simulated time are due; if so, the next are due later."""
        if time < self._next - 1e-9:
            return False
        self._next = max(self._next + self.choice.interval, time)  # late rows are not made up for
        return True

    def write(
        self,
        stamp: int,
        poses: Mapping[str, Pose],
        render: Callable[[str, RecordedImage], Tensor],
    ) -> bool:
        """Write the rows of a time stamp; return whether that works, else close and log why.

        `render` returns an image of the named vehicle: (H, W, 3) uint8, or (H, W) float32.
        """
        first = next(iter(poses))
        try:
            for name, pose in poses.items():
                if not self.choice.on_move or self._poses.get(name, _ORIGIN) != pose:
                    self._poses[name] = pose
                    chosen = [i for i in self.choice.images or () if name == (i.vehicle or first)]
                    images = [*_USUAL] if self.choice.images is None else chosen
                    self._write_row(stamp, name, pose, images, render)
        except OSError as error:
            _log.error("the recording ends: it can't be written (%s)", error.strerror)
            with contextlib.suppress(OSError):
                self.close()
            return False
        return True

    def _write_row(
        self,
        stamp: int,
        name: str,
        pose: Pose,
        images: list[RecordedImage],
        render: Callable[[str, RecordedImage], Tensor],
    ) -> None:
        letters = to_letters(name)
        if letters != name:  # other names may have the same letters
            letters += f"_{zlib.crc32(name.encode('utf-8', 'replace')):08x}"
        files = []
        for image in images:
            ending = "pfm" if image.as_float else "png" if image.compress else "ppm"
            files.append(f"img_{letters}_{image.label}_{image.kind.value}_{stamp}.{ending}")
            _save(render(name, image), self.path / "images" / files[-1])
        values = (*pose.position, *pose.attitude)
        word = re.sub(r"[\s#]", "_", name) or "Vehicle"  # a column of numpy has no spaces
        row: list[Any] = [word, stamp // 1_000_000, *(f"{v:.6g}" for v in values), ";".join(files)]
        self._table.write("\t".join(map(str, row)) + "\n")
        self._table.flush()

    def close(self) -> None:
        """Close the table."""
        self._table.close()


def _save(image: Tensor, path: Path) -> None:
    """Write a PNG or PPM file; numbers as a PFM file, from the top row on as AirSim writes it."""
    if path.suffix == ".pfm":
        height, width = image.shape
        path.write_bytes(b"Pf\n%d %d\n-1.0\n" % (width, height) + image.numpy().tobytes())
    else:
        Image.fromarray(image.numpy()).save(path, compress_level=1)


def to_letters(name: str) -> str:
    """Replace all but ASCII letters and digits by "_"; return at most 64 of them."""
    return "".join(c if c.isascii() and c.isalnum() else "_" for c in name)[:64]
