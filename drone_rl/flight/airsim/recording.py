"""Recordings as AirSim writes them: a tab-separated table and an image of each time."""

import datetime
import io
from pathlib import Path
from typing import TYPE_CHECKING, Any

from PIL import Image

from drone_rl.flight.airsim.messages import nanoseconds
from drone_rl.sim.image_types import ImageType
from drone_rl.utils.errors import InputError

if TYPE_CHECKING:
    from drone_rl.flight.airsim.simulation import Simulation

INTERVAL = 0.05
"""Simulated seconds between two rows."""
_COLUMNS = (
    "VehicleName TimeStamp POS_X POS_Y POS_Z Q_W Q_X Q_Y Q_Z ImageFile".replace(" ", "\t") + "\n"
)


class Recording:
    """Writes `airsim_rec.txt` and `images/` to a new folder, named by the time of day.

    numpy reads the table by `numpy.genfromtxt(path, names=True, dtype=None, encoding="utf-8")`.
    """

    def __init__(self, folder: Path, simulation: "Simulation") -> None:
        """Create the folder and write the first row of each vehicle."""
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
        self._next = simulation.time
        self.note(simulation)

    def note(self, simulation: "Simulation") -> None:
        """Write a row of each vehicle if one is due."""
        if simulation.time < self._next - 1e-9:
            return
        self._next = simulation.time + INTERVAL
        for name, vehicle in simulation.vehicles.items():
            stamp = nanoseconds(simulation.time)
            file = f"img_{to_letters(name)}_0_{stamp}.png"
            pose = vehicle.pose
            values = (*pose.position, *pose.attitude)
            row: list[Any] = [name or "Vehicle", stamp, *(f"{v:.6g}" for v in values), file]
            self._table.write("\t".join(map(str, row)) + "\n")
            camera = simulation.cameras[name]["front_center"]
            (found,) = simulation.stage.render(
                vehicle.body, "front_center", camera, [ImageType.SCENE]
            )
            pixels = simulation.stage.image(ImageType.SCENE, found, as_float=False)
            Image.fromarray(pixels.numpy()).save(self.path / "images" / file, compress_level=1)
        self._table.flush()

    def close(self) -> None:
        """Close the table."""
        self._table.close()


def to_letters(name: str) -> str:
    """Return a name as a part of a file's name."""
    return "".join(c if c.isascii() and c.isalnum() else "_" for c in name)[:64]
