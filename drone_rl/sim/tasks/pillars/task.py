"""Fly through a field of pillars to the line beyond it."""

from drone_rl.config import PillarsSettings
from drone_rl.sim.tasks.pillars.explaining import Explaining
from drone_rl.sim.tasks.pillars.judging import Judging
from drone_rl.sim.tasks.pillars.playing import Playing


class Pillars(Playing, Judging, Explaining):
    """Get to the line and touch no pillar. The reward is progress, 1 for the whole way."""

    name = PillarsSettings.name

    def __init__(self, settings: PillarsSettings | None = None) -> None:
        """Takes the settings.

        Args:
            settings: Field, pillars and moves.
        """
        self.settings = settings or PillarsSettings()
