"""`drone-rl plot`: its settings."""

import logging
from pathlib import Path
from typing import Annotated

from drone_rl.cli.settings import CommandSettings
from drone_rl.utils.files import write_atomically
from drone_rl.utils.schema import Listed, OneOf

_log = logging.getLogger(__name__)


class PlotCommand(CommandSettings):
    """Draw learning curves of runs: drone-rl plot FOLDER...

    Runs that differ only in their seed are one curve: the median, with a band from the lowest to
    the highest. The y axis is the success rate, or the running reward where it was not logged.
    """

    unnamed = "runs"
    runs: Annotated[tuple[str, ...], Listed("folder")] = ("outputs/train",)
    """Folders of runs, of sweeps, or others that contain some."""
    x: Annotated[str, OneOf(("frames", "seconds"))] = "frames"
    """The x axis: frames, or seconds of training."""

    def run(self, folder: Path) -> tuple[int, None]:
        """Draw the curves; return the exit status."""
        from drone_rl.sweeps.curves import plot_curves  # slow to import
        from drone_rl.trust.plots.saving import to_png

        path = folder / "curves.png"
        write_atomically(path, to_png(plot_curves(self.runs, self.x)))
        _log.info("written: %s", path)
        return 0, None
