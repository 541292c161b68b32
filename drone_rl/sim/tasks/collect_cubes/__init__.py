"""Collect the cubes (chapter, section 4)."""

from drone_rl.sim.tasks.collect_cubes.practice import Practice
from drone_rl.sim.tasks.collect_cubes.require import require_cubes, require_moves
from drone_rl.sim.tasks.collect_cubes.task import CollectCubes

__all__ = ["CollectCubes", "Practice", "require_cubes", "require_moves"]
