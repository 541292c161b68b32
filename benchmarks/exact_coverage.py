"""Verdicts by flights against the truth: how often do their intervals hold the exact share?

The policies are those of short trainings, looked at while they learn: what each succeeds from is a
proof's word, exact to the last placement. Those that always succeed, or never, prove nothing of an
interval and are left out, as are those that share their success with one that is taken already.
"""

import dataclasses
import shutil
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from drone_rl.config import TaskSettings
from drone_rl.config.learning import Threads
from drone_rl.config.training import TrainerSettings
from drone_rl.evaluation.judge import judge_policy
from drone_rl.policies.policy import Policy, load_policy
from drone_rl.training import Callback
from drone_rl.training.callbacks import OngoingTraining
from drone_rl.training.train import train
from drone_rl.utils.progress import silent
from drone_rl.verification.prove import prove

POLICIES, REPEATS, EPISODES = 20, 20, 400
SEEDS = range(30)
"""Of trainings, as many of them as it takes."""
STAGES = (64, 128, 192, 256)
"""Episodes after which a training is looked at."""
UNDECIDED = 1e-4
"""Share of the placements that a proof may leave open, at most."""
TRIVIAL = 0.005
"""Success less than this from none or from all is no trial."""


@dataclasses.dataclass(frozen=True)
class Truth:
    """The exact share of placements from which a policy succeeds, as far as it is decided."""

    success: float
    undecided: float

    @property
    def is_trial(self) -> bool:
        """Whether it is far enough from none and from all to try an interval."""
        return TRIVIAL < self.success < 1 - TRIVIAL

    def is_held(self, interval: Mapping[str, float]) -> bool:
        """Whether an interval holds the share, whatever becomes of what is undecided."""
        low, high = interval["lower95"], interval["upper95"]
        return low <= self.success + self.undecided and self.success <= high


def bench_exact_coverage(folder: Path, quick: bool) -> dict[str, Any]:
    """Flies verdicts on policies of which the truth is known.

    Args:
        folder: Where trainings are kept.
        quick: Whether to look at one policy that travels with the package, by a few flights.
    """
    most, repeats, episodes = (1, 3, 50) if quick else (POLICIES, REPEATS, EPISODES)
    rows: list[dict[str, Any]] = []
    left_out = {"always or never": 0, "as another": 0, "undecided": 0}
    for name, policy in _policies(folder, quick):
        proof = prove(policy, compared=500, progress=silent)
        truth = Truth(proof.success, proof.undecided)
        why = _why_not(truth, [row["success"] for row in rows])
        if why is not None:
            left_out[why] += 1
            continue
        held = [truth.is_held(i) for i in _intervals(policy, len(rows), repeats, episodes)]
        of = {"held": sum(held), "verdicts": len(held)}
        rows.append({"policy": name, **dataclasses.asdict(truth), **of})
        if len(rows) == most:
            break
    return count(rows) | {"verdict_coverage_exact_left_out": left_out}


def count(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """The figures.

    Args:
        rows: Of each policy how many "verdicts" it got, how many "held" the truth, and more.
    """
    held, total = (sum(row[key] for row in rows) for key in ("held", "verdicts"))
    return {
        "verdict_coverage_exact": held / total,
        "verdict_coverage_exact_held": held,
        "verdict_coverage_exact_total": total,
        "verdict_coverage_exact_policies": rows,
    }


def _why_not(truth: Truth, taken: list[float]) -> str | None:
    """Why a policy is left out; None if it isn't."""
    if truth.undecided > UNDECIDED:
        return "undecided"
    if not truth.is_trial:
        return "always or never"
    return "as another" if any(abs(truth.success - t) <= UNDECIDED for t in taken) else None


def _intervals(
    policy: Policy, seed: int, repeats: int, episodes: int
) -> Iterator[Mapping[str, float]]:
    """The intervals of success that verdicts state, each of episodes in worlds of its own."""
    with policy.flying(episodes, seed=seed) as (env, actor):
        for _ in range(repeats):  # the worlds' streams go on: no two verdicts share a world
            verdict = judge_policy(env, actor, episodes, sampled=False)
            yield verdict.evidence["greedy"]["success"]


def _policies(folder: Path, quick: bool) -> Iterator[tuple[str, Policy]]:
    """Names and policies, each in the task of one cube; trains as it goes."""
    if quick:
        yield "right_and_forward", load_policy("right_and_forward").in_task(num_cubes=1)
        return
    for seed in SEEDS:
        run = folder / f"exact_{seed}"
        shutil.rmtree(run, ignore_errors=True)
        train(
            folder=run,
            task=TaskSettings(num_cubes=1),
            collector=Threads(num_envs=16),
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
    """Keeps the checkpoints of all stages; each was written as the last one just before."""

    def __init__(self, folder: Path) -> None:
        """Takes the folder of the checkpoints."""
        self.folder = folder

    def on_update(self, training: OngoingTraining, metrics: Mapping[str, float]) -> None:
        """Keeps the last checkpoint if it is time."""
        if (episodes := training.progress.episodes) in STAGES:
            shutil.copyfile(self.folder / "last.pt", self.folder / f"after_{episodes}.pt")
