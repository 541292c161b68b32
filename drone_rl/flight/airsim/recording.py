"""Recordings as AirSim writes them: a tab-separated table and an image of each time."""

import datetime
import io
import re
import zlib
from pathlib import Path
from typing import Any

from PIL import Image
from torch import Tensor

from drone_rl.flight.airsim.messages import Pose
from drone_rl.utils.errors import InputError

INTERVAL = 0.05
"""Least simulated seconds between two rows, which are whole control periods apart."""
_COLUMNS = (
    "VehicleName TimeStamp POS_X POS_Y POS_Z Q_W Q_X Q_Y Q_Z ImageFile".replace(" ", "\t") + "\n"
)


class Recording:
    """Writes `airsim_rec.txt` and `images/` to a new folder, named by date and time.

    numpy reads the table by `numpy.genfromtxt(path, names=True, dtype=None, encoding="utf-8")`.
    """

    def __init__(self, folder: Path, begin: float) -> None:
        """Create the folder; rows are due from the simulated time `begin`, seconds.

        Raises an `InputError` if it can't be written.
        """
        now = datetime.datetime.now().strftime("%Y-%m-%d-%H-%M-%S-%f")
        self.path = folder / now
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

    def take_turn(self, time: float) -> bool:
        """Return whether rows of this simulated time are due; if so, the next are due later."""
        if time < self._next - 1e-9:
            return False
        self._next = time + INTERVAL
        return True

    def write(self, stamp: int, name: str, pose: Pose, image: Tensor) -> None:
        """Write the row of a vehicle at a time stamp, with its image (H, W, 3), uint8."""
        letters = to_letters(name)
        if letters != name:  # other names may have the same letters
            letters += f"_{zlib.crc32(name.encode('utf-8', 'replace')):08x}"
        file = f"img_{letters}_0_{stamp}.png"
        values = (*pose.position, *pose.attitude)
        word = re.sub(r"[\s#]", "_", name) or "Vehicle"  # a column of numpy has no spaces
        row: list[Any] = [word, stamp, *(f"{v:.6g}" for v in values), file]
        self._table.write("\t".join(map(str, row)) + "\n")
        self._table.flush()
        Image.fromarray(image.numpy()).save(self.path / "images" / file, compress_level=1)

    def close(self) -> None:
        """Close the table."""
        self._table.close()


def to_letters(name: str) -> str:
    """Replace all but ASCII letters and digits by "_"; return at most 64 of them."""
    return "".join(c if c.isascii() and c.isalnum() else "_" for c in name)[:64]
