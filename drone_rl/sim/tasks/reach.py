"""Reach a goal in a scene file without touching what is solid."""

from drone_rl.config.reach import ReachSettings
from drone_rl.sim.tasks.task import register_task
from drone_rl.sim.tasks.term_task import TermTask

register_task(ReachSettings, TermTask)
