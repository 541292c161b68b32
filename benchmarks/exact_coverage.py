"""Coverage of the intervals of verdicts, measured against exact success rates.

The policies are checkpoints of short trainings. A proof gives the exact success rate of each over
all placements of the cube. Policies that succeed always or never do not test an interval and are
left out, and so are policies with the success rate of an earlier one.
"""

import dataclasses
import shutil
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from benchmarks.benchmark import Setup
from drone_rl.config import TaskSettings
from drone_rl.config.learning import Episodes
from drone_rl.config.training import TrainerSettings
from drone_rl.policies.policy import Policy, load_policy
from drone_rl.training import Callback
from drone_rl.training.callbacks import OngoingTraining
from drone_rl.training.train import train
from drone_rl.trust.verdict import judge_policy
from drone_rl.utils.intervals import Share
from drone_rl.utils.progress import silent
from drone_rl.verification.prove import prove

POLICIES, REPEATS, EPISODES = 20, 20, 400
SEEDS = range(30)
"""Seeds of trainings; only as many as necessary are used."""
STAGES = (64, 128, 192, 256)
"""Episodes after which a checkpoint of a training is kept."""
UNDECIDED = 1e-4
"""Largest fraction of placements that a proof may leave undecided."""
TRIVIAL = 0.005
"""Policies with a success rate within this distance of 0 or 1 are left out."""


@dataclasses.dataclass(frozen=True)
class Truth:
    """The exact fraction of placements from which a policy succeeds, and the undecided fraction."""

    success: float
    undecided: float

    @property
    def is_informative(self) -> bool:
        """Whether the success rate is far enough from 0 and 1 to test an interval."""
        return TRIVIAL < self.success < 1 - TRIVIAL

    def is_covered(self, interval: Share) -> bool:
        """Return whether an interval can contain the success rate."""
        low, high = interval.lower95, interval.upper95
        return low <= self.success + self.undecided and self.success <= high


def bench_exact_coverage(setup: Setup) -> dict[str, Any]:
    """Judge policies with exactly known success rates.

    Returns:
        The figures of `count`, and "verdict_coverage_exact_left_out", numbers of policies that are
        left out, by reason.
    """
    folder = setup.runs / "exact_coverage"
    most, repeats, episodes = (1, 3, 50) if setup.quick else (POLICIES, REPEATS, EPISODES)
    rows: list[dict[str, Any]] = []
    left_out = {"always or never": 0, "as another": 0, "undecided": 0}
    for name, policy in _policies(folder, setup.quick):
        proof = prove(policy, compared=500, progress=silent)
        truth = Truth(proof.success, proof.undecided)
        reason = _reason_to_leave_out(truth, [row["success"] for row in rows])
        if reason is not None:
            left_out[reason] += 1
            continue
        covered = [truth.is_covered(i) for i in _intervals(policy, len(rows), repeats, episodes)]
        counts = {"held": sum(covered), "verdicts": len(covered)}
        rows.append({"policy": name, **dataclasses.asdict(truth), **counts})
        if len(rows) == most:
            break
    return count(rows) | {"verdict_coverage_exact_left_out": left_out}


def count(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Return the figures of all policies.

    Args:
        rows: For each policy the number of "verdicts", the number that "held" the true success
            rate, and other entries.
    """
    held, total = (sum(row[key] for row in rows) for key in ("held", "verdicts"))
    return {
        "verdict_coverage_exact": held / total,
        "verdict_coverage_exact_held": held,
        "verdict_coverage_exact_total": total,
        "verdict_coverage_exact_policies": rows,
    }


def _reason_to_leave_out(truth: Truth, earlier: list[float]) -> str | None:
    """Return why a policy is left out; None if it is used."""
    if truth.undecided > UNDECIDED:
        return "undecided"
    if not truth.is_informative:
        return "always or never"
    return "as another" if any(abs(truth.success - e) <= UNDECIDED for e in earlier) else None


def _intervals(policy: Policy, seed: int, repeats: int, episodes: int) -> Iterator[Share]:
    """Yield the success intervals of verdicts, each from other environments."""
    with policy.flying(episodes, seed=seed) as (env, actor):
        for _ in range(repeats):  # random streams continue, so verdicts share no environment
            verdict = judge_policy(env, actor, episodes, sampled=False)
            yield verdict.greedy.success


def _policies(folder: Path, quick: bool) -> Iterator[tuple[str, Policy]]:
    """Yield names and policies for the task with one cube; train on demand."""
    if quick:
        yield "right_and_forward", load_policy("right_and_forward").in_task(num_cubes=1)
        return
    for seed in SEEDS:
        run = folder / f"exact_{seed}"
        shutil.rmtree(run, ignore_errors=True)
        train(
            folder=run,
            task=TaskSettings(num_cubes=1),
            collector=Episodes(num_envs=16),
            trainer=TrainerSettings(
                total_episodes=STAGES[-1], target_share=None, checkpoint_interval_s=0.0
            ),
            seed=seed,
            callbacks=[_Keep(run / "checkpoints")],
            progress=silent,
        )
        for episodes in STAGES:
            kept = run / "checkpoints" / f"after_{episodes}.pt"
            yield f"seed {seed} after {episodes} episodes", load_policy(kept)


class _Keep(Callback):
    """Copy the last checkpoint at each stage; it was written just before."""

    def __init__(self, folder: Path) -> None:
        """Store the folder of the checkpoints."""
        self.folder = folder

    def on_update(self, training: OngoingTraining, metrics: Mapping[str, float]) -> None:
        """Copy the last checkpoint if a stage is reached."""
        if (episodes := training.progress.episodes) in STAGES:
            shutil.copyfile(self.folder / "last.pt", self.folder / f"after_{episodes}.pt")
