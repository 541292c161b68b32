"""Tasks: scenes, resets, rules, goals, and the changes that explanations make."""

from drone_rl.sim.tasks.collect_cubes import CollectCubes as CollectCubes
from drone_rl.sim.tasks.collect_cubes import FailureReplayTask as FailureReplayTask
from drone_rl.sim.tasks.objects import ObjectState as ObjectState
from drone_rl.sim.tasks.objects import ObjectTask as ObjectTask
from drone_rl.sim.tasks.pillars import Pillars as Pillars
from drone_rl.sim.tasks.reach import ReachSettings as ReachSettings
from drone_rl.sim.tasks.scene_edits import Grid as Grid
from drone_rl.sim.tasks.task import EndReason as EndReason
from drone_rl.sim.tasks.task import Goals as Goals
from drone_rl.sim.tasks.task import OracleRule as OracleRule
from drone_rl.sim.tasks.task import Prop as Prop
from drone_rl.sim.tasks.task import SampledState as SampledState
from drone_rl.sim.tasks.task import State as State
from drone_rl.sim.tasks.task import Task as Task
from drone_rl.sim.tasks.task import as_settings as as_settings
from drone_rl.sim.tasks.task import as_task as as_task
from drone_rl.sim.tasks.task import register_task as register_task
