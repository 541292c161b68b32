"""Success of policies cloned from the oracle's demonstrations, before and after REINFORCE."""

from typing import Any

from benchmarks.benchmark import Setup
from benchmarks.commands import train
from benchmarks.training import evaluate
from drone_rl.training.demonstrations import record_oracle

DEMONSTRATIONS = 30
"""Flights of the oracle from which each policy is cloned."""
_SEED = 2000
"""Added to a training's seed for its demonstrations, so that their scenes are others."""


def bench_imitation(setup: Setup) -> dict[str, Any]:
    """Clone demonstrations of the oracle by `experiment=imitation`, with and without REINFORCE.

    The runs of a seed begin with the same clone; one of them stops there.

    Returns:
        For each seed "imitation_success", the success rate of the clone, and
        "imitation_reinforce_success", that after REINFORCE; "imitation_accuracy", the fraction of
        held-out frames in which the clone acts as the oracle; "imitation_s", seconds of cloning;
        "imitation_reinforce_frames", frames that REINFORCE collected; "imitation_solved", the
        number of seeds that reached the target.
    """
    rows = [_run_seed(setup, seed) for seed in setup.seeds[:3]]
    names = ("success", "reinforce_success", "accuracy", "s", "reinforce_frames")
    return {
        **{f"imitation_{name}": [row[name] for row in rows] for name in names},
        "imitation_solved": sum(row["reason"] == "solved" for row in rows),
    }


def _run_seed(setup: Setup, seed: int) -> dict[str, Any]:
    """Record demonstrations, clone and train from one seed; return its figures and the reason."""
    folder = setup.runs / "imitation"
    demonstrations = folder / f"demonstrations_{seed}"
    record_oracle(demonstrations, flights=DEMONSTRATIONS, seed=_SEED + seed)
    settings = ["experiment=imitation", f"demonstrations={demonstrations}", f"seed={seed}"]
    settings.append(f"device={setup.device}")
    clone, whole = folder / f"clone_{seed}", folder / f"reinforce_{seed}"
    train(clone, *settings, "trainer.total_frames=0")
    _, result = train(whole, *settings, *(["trainer.total_frames=4000"] if setup.quick else []))
    assert result.cloning is not None
    return {
        "success": evaluate(setup, clone)["share"],
        "reinforce_success": evaluate(setup, whole)["share"],
        "accuracy": result.cloning.held_out_accuracy,
        "s": result.cloning.seconds,
        "reinforce_frames": result.frames,
        "reason": result.reason,
    }
