"""Success of policies cloned from the oracle's demonstrations, before and after REINFORCE."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from benchmarks.commands import train
from benchmarks.training import evaluate
from drone_rl.training.demonstrations import record_oracle

DEMONSTRATIONS = 30
"""Flights of the oracle from which each policy is cloned."""
_SEED = 2000
"""Added to a training's seed for its demonstrations, so that their scenes are others."""


def bench_imitation(
    folder: Path, seeds: Sequence[int], episodes: int, device: str, quick: bool
) -> dict[str, Any]:
    """Clone demonstrations of the oracle by `experiment=imitation`, with and without REINFORCE.

    The runs of a seed begin with the same clone; one of them stops there.

    Args:
        folder: Folder of the demonstrations and runs.
        seeds: Seeds of the trainings.
        episodes: Held-out episodes of each greedy policy.
        device: Device of training and evaluation.
        quick: Whether to train only one seed, briefly.

    Returns:
        For each seed "imitation_success", the success rate of the clone, and
        "imitation_reinforce_success", that after REINFORCE; "imitation_accuracy", the fraction of
        held-out frames in which the clone acts as the oracle; "imitation_s", seconds of cloning;
        "imitation_reinforce_frames", frames that REINFORCE collected; "imitation_solved", the
        number of seeds that reached the target.
    """
    rows = [
        _run_seed(folder, seed, 50 if quick else episodes, device, quick)
        for seed in (seeds[:1] if quick else seeds)
    ]
    names = ("success", "reinforce_success", "accuracy", "s", "reinforce_frames")
    return {
        **{f"imitation_{name}": [row[name] for row in rows] for name in names},
        "imitation_solved": sum(row["reason"] == "solved" for row in rows),
    }


def _run_seed(folder: Path, seed: int, episodes: int, device: str, quick: bool) -> dict[str, Any]:
    """Record demonstrations, clone and train from one seed; return its figures and the reason."""
    flights = folder / f"demonstrations_{seed}"
    record_oracle(flights, flights=DEMONSTRATIONS, seed=_SEED + seed)
    own = ["experiment=imitation", f"demonstrations={flights}", f"seed={seed}", f"device={device}"]
    clone, whole = folder / f"clone_{seed}", folder / f"reinforce_{seed}"
    train(clone, *own, "trainer.total_frames=0")
    success = evaluate(clone, episodes, device)["share"]
    _, result = train(whole, *own, *(["trainer.total_frames=4000"] if quick else []))
    return {
        "success": success,
        "reinforce_success": evaluate(whole, episodes, device)["share"],
        "accuracy": result["cloning"]["held_out_accuracy"],
        "s": result["cloning"]["seconds"],
        "reinforce_frames": result["frames"],
        "reason": result["reason"],
    }
