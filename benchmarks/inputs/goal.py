"""A user's task that needs an image and a goal: what policies reach with and without the image."""

import shutil
import tempfile
import time
from pathlib import Path
from typing import Any

from benchmarks.benchmark import Setup
from benchmarks.commands import call
from drone_rl.trust.rule import VerdictKind
from drone_rl.utils.exit_codes import NOT_CERTAIN
from drone_rl.utils.files import read_json
from drone_rl.utils.run_result import RunResult

TASK = Path(__file__).parents[1] / "own_task" / "goal_behind_boxes.py"
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
_STATUSES = (NOT_CERTAIN, *(kind.exit_code for kind in VerdictKind))


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
    most = 20_000 if setup.quick else most
    lower, seconds, frames, without = [], [], [], []
    with tempfile.TemporaryDirectory() as folder:
        own = Path(folder)
        shutil.copy(TASK, own)
        for seed in setup.seeds[:3]:
            run = setup.runs / name / f"seeing_{seed}"
            begin = time.perf_counter()
            train(own, run, seed, most, *seeing, *settings)
            seconds.append(time.perf_counter() - begin)
            frames.append(RunResult.read_json(run / "result.json").frames)
            lower.append(_success(own, run, setup.quick)["lower95"])
            run = setup.runs / name / f"blind_{seed}"
            train(own, run, seed, frames[-1], *blind, *settings, "trainer.target_share=null")
            without.append(_success(own, run, setup.quick)["share"])
    return {
        f"{name}_lower95": min(lower),
        f"{name}_s": max(seconds),
        f"{name}_frames": frames,
        f"{name}_blind": max(without),
    }


def train(own: Path, run: Path, seed: int, most: int, *settings: str) -> None:
    """Train the task in a folder that holds its file, for at most so many frames."""
    task = (f"plugins={TASK.name}", f"task={TASK.stem}", "logger=csv", f"seed={seed}")
    call(
        "train",
        *task,
        *settings,
        f"trainer.total_frames={most}",
        f"hydra.run.dir={run}",
        folder=own,
    )


def _success(own: Path, run: Path, quick: bool) -> dict[str, Any]:
    """Return the success rate of a verdict, with its interval."""
    made, few = run / "verdict", ["episodes=100"] if quick else []
    where = (f"plugins={TASK.name}", f"hydra.run.dir={made}")
    call("verdict", f"policy={run}", *where, *few, statuses=_STATUSES, folder=own)
    return read_json(made / "verdict.json")["greedy"]["success"]
