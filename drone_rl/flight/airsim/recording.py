"""Recordings: the vehicles' poses and images over time, as AirSim records them."""

import contextlib
import datetime
import io
import logging
import re
import urllib.parse
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from PIL import Image
from torch import Tensor

from drone_rl.flight.airsim.messages import Pose
from drone_rl.flight.airsim.settings_file import RecordedImage, RecordingChoice
from drone_rl.utils.errors import InputError

_log = logging.getLogger(__name__)

_COLUMNS = (
    "VehicleName TimeStamp POS_X POS_Y POS_Z Q_W Q_X Q_Y Q_Z ImageFile".replace(" ", "\t") + "\n"
)


_ORIGIN = Pose((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))


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
        later = self._next + self.choice.record_interval
        self._next = max(later, time)  # late rows are not made up for
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
                if not self.choice.record_on_move or self._poses.get(name, _ORIGIN) != pose:
                    self._poses[name] = pose
                    images = [RecordedImage()]
                    if (chosen := self.choice.cameras) is not None:
                        images = [i for i in chosen if name == (i.vehicle_name or first)]
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
        letters = urllib.parse.quote(name, "", errors="replace")
        files = []
        for image in images:
            ending = "pfm" if image.as_float else "png" if image.compress else "ppm"
            files.append(f"img_{letters}_{image.label}_{image.image_type}_{stamp}.{ending}")
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
