"""Collect the cubes (chapter, section 4)."""

from drone_rl.config import TaskSettings
from drone_rl.sim.tasks.collect_cubes.explaining import Explaining
from drone_rl.sim.tasks.collect_cubes.judging import Judging
from drone_rl.sim.tasks.collect_cubes.playing import Playing


class CollectCubes(Playing, Judging, Explaining):
    """Move until every cube is touched. The reward is 1 a cube."""

    name = "collect_cubes"

    def __init__(self, settings: TaskSettings | None = None) -> None:
        """Takes the settings.

        Args:
            settings: Cubes, moves and boundaries; the original study's by default.
        """
        self.settings = settings or TaskSettings()
