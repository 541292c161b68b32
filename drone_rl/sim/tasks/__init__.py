"""What there is to do in a world, and what can be asked about it."""

from drone_rl.sim.tasks.collect_cubes import CollectCubes, Practice
from drone_rl.sim.tasks.explainable import Grid
from drone_rl.sim.tasks.judgeable import Goals, OracleRule
from drone_rl.sim.tasks.pillars import Pillars
from drone_rl.sim.tasks.playable import Prop, State
from drone_rl.sim.tasks.registry import as_task, register_task
from drone_rl.sim.tasks.task import Task

__all__ = [
    "CollectCubes",
    "Goals",
    "Grid",
    "OracleRule",
    "Pillars",
    "Practice",
    "Prop",
    "State",
    "Task",
    "as_task",
    "register_task",
]
