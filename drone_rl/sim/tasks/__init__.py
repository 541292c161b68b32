"""What there is to do in a world, and what can be asked about it."""

from typing import Any

from drone_rl.sim.settings import TaskSettings
from drone_rl.sim.tasks.collect_cubes import CollectCubes, Practice
from drone_rl.sim.tasks.explainable import Grid
from drone_rl.sim.tasks.judgeable import Goals, OracleRule
from drone_rl.sim.tasks.playable import Prop, State
from drone_rl.sim.tasks.task import Task

__all__ = [
    "CollectCubes",
    "Goals",
    "Grid",
    "OracleRule",
    "Practice",
    "Prop",
    "State",
    "Task",
    "as_task",
]


def as_task(task: TaskSettings | Task[Any] | None) -> Task[Any]:
    """The task of some settings; the original study's by default."""
    if task is None or isinstance(task, TaskSettings):
        return CollectCubes(task)
    return task
