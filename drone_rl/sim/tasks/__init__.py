"""Tasks: what stands in the scene, how an episode starts, its rules, and what counts as success."""

from drone_rl.sim.tasks.collect_cubes import CollectCubes, FailureReplayTask
from drone_rl.sim.tasks.pillars import Pillars
from drone_rl.sim.tasks.task import (
    DrawnState,
    EndReason,
    Goals,
    Grid,
    OracleRule,
    Prop,
    State,
    Task,
    as_task,
    register_task,
)

__all__ = [
    "CollectCubes",
    "DrawnState",
    "EndReason",
    "FailureReplayTask",
    "Goals",
    "Grid",
    "OracleRule",
    "Pillars",
    "Prop",
    "State",
    "Task",
    "as_task",
    "register_task",
]
