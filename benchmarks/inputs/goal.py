"""A user's task that needs an image and a goal: what policies reach with and without the image."""

import contextlib
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from benchmarks.benchmark import Setup
from benchmarks.seeing import train_both

TASK = Path(__file__).parents[1] / "own_task" / "goal_behind_boxes.py"
PLUGIN, TASK_NAME = f"plugins={TASK.name}", f"task={TASK.stem}"
PPO = (
    *("objective=ppo", "objective.num_steps=64", "objective.epochs=3"),
    *("objective.minibatch_size=1024", "returns.gamma=0.98", "optimizer.lr=1e-3"),
    *("collector.num_envs=256", "trainer.confirm_share=0.93"),
)
"""Settings of the learner."""
WALKING = (*PPO, "objective.entropy_coeff=0.01", "actions=moves_turning")
SEEING, BLIND = ("inputs=[gray,goal,last_action]",), ("inputs=[goal,last_action]",)
FLYING = (
    *(*PPO, "objective.entropy_coeff=0.003", "dynamics=quadrotor", "actions=velocity"),
    # 0.3 s: drones follow commands within about a second; noise of shorter actions cancels out.
    "dynamics.control_ticks=100",
    # The drone stops within 2.2 m, and goes to the side within what the camera shows.
    *("actions.forward_speed=2.5", "actions.sideways_speed=1", "actions.yaw_rate=90"),
    *("inputs.goal.scale=5", "inputs.velocity.scale=2"),
)
SEEING_DEPTH = (
    *("inputs=[depth,goal,velocity]", "inputs.depth.size=[12,24]"),
    *("inputs.depth.horizontal_fov=110", "inputs.depth.maximum=8"),
)
BLIND_FLIGHT = ("inputs=[goal,velocity]",)


def bench_goal(setup: Setup) -> dict[str, Any]:
    """Train to reach a goal behind boxes, seeing and blind, by moves that turn.

    Returns:
        "goal_lower95", the smallest lower bound of the success rate of policies that see,
        "goal_s", the most seconds until such a training ends, "goal_frames" of each, and
        "goal_blind", the largest success rate of policies that learned without the image from as
        many frames.
    """
    return _compare(setup, "goal", WALKING, SEEING, BLIND, 3_000_000)


def bench_goal_flight(setup: Setup) -> dict[str, Any]:
    """As `bench_goal`, with depth and velocity, flown by the quadrotor: "goal_flight_..."."""
    return _compare(setup, "goal_flight", FLYING, SEEING_DEPTH, BLIND_FLIGHT, 4_000_000)


def _compare(
    setup: Setup,
    name: str,
    settings: tuple[str, ...],
    seeing: tuple[str, ...],
    blind: tuple[str, ...],
    most: int,
) -> dict[str, Any]:
    both = (*seeing, *settings, TASK_NAME), (*blind, *settings, TASK_NAME)
    with own_folder() as folder:
        made = train_both(setup, setup.runs / name, most, *both, (PLUGIN,), folder)
    return {
        f"{name}_lower95": min(one["lower95"] for one in made.seeing),
        f"{name}_s": max(made.seconds),
        f"{name}_frames": made.frames,
        f"{name}_blind": max(one["share"] for one in made.blind),
    }


@contextlib.contextmanager
def own_folder() -> Iterator[Path]:
    """Make a folder that holds the task's file, and delete it at the end."""
    with tempfile.TemporaryDirectory() as folder:
        shutil.copy(TASK, folder)
        yield Path(folder)
