"""Fly through a field of pillars, and touch none."""

from drone_rl.sim.tasks.pillars.task import Pillars

__all__ = ["Pillars"]
