"""`drone-rl sweep-report`: its settings."""

import logging
from pathlib import Path

from drone_rl.cli.settings import CommandSettings
from drone_rl.config.values import NumEpisodes

_log = logging.getLogger(__name__)


class SweepReportCommand(CommandSettings):
    """Compare the runs of a sweep: drone-rl sweep-report FOLDER.

    Every sweep also ends with it.
    """

    unnamed = "folder"
    folder: str = "latest"
    """Folder of the sweep, or latest for the newest one."""
    picture: str | None = None
    """Path of a PNG chart of verdicts, one-sided policies and entropies to write; null for none."""
    judge: bool = False
    """Whether to repeat the verdict on each finished run's last.pt with the current rule."""
    episodes: NumEpisodes = 200
    """Episodes of each of these verdicts, in environments reserved for model selection."""
    device: str = "cpu"
    """Device of these episodes: cpu, cuda or cuda:N."""

    def run(self, folder: Path) -> tuple[int, None]:
        """Report on a sweep, finished or not; return the exit status."""
        from drone_rl.sweeps import report  # slow to import

        sweep = report.find_sweep(self.folder, self.paths.outputs)
        if self.judge:
            report.judge_sweep(sweep, self.episodes, self.device)
        page, summary = report.write_sweep_report(sweep)
        print(report.terminal_lines(summary))
        if self.picture is not None:
            report.write_picture(sweep, Path(self.picture))
            _log.info("written: %s", self.picture)
        _log.info("written: %s", page)
        return 0, None
