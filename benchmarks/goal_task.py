"""The task of a goal behind boxes: how often a straight path to the goal is blocked."""

from pathlib import Path
from typing import Any

import numpy as np
import torch

from drone_rl.config import BaseTaskSettings
from drone_rl.sim.tasks.geometry_kernel import GOAL, OBSTACLE
from drone_rl.sim.worlds import Worlds
from drone_rl.utils.plugins import import_plugin

FILE = Path(__file__).parent / "own_task" / "goal_behind_boxes.py"
"""A user's file, which defines the task."""


def blocked_share(episodes: int = 2000, task: str = "goal_behind_boxes") -> float:
    """Return the fraction of episodes in which a drone that flies straight on touches an obstacle.

    It goes from its start to the centre of the first goal of a task of terms.
    """
    import_plugin(str(FILE))
    worlds = Worlds(episodes, BaseTaskSettings.read({"name": task}))
    worlds.reset(torch.arange(episodes), [np.random.RandomState(i) for i in range(episodes)])
    state: Any = worlds.state
    rules: Any = worlds.task
    goal = state.places[:, int((rules.roles == GOAL).nonzero()[0, 0])]
    after, _ = rules.step(state, state.body.moved(goal.clone()))
    return float(after.touched[:, rules.roles == OBSTACLE].any(-1).double().mean())
