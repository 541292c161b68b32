"""The speed of the chapter's own algorithm, and policies with memory."""

import os
import statistics
from pathlib import Path
from typing import Any

from benchmarks.benchmark import Setup
from benchmarks.commands import call, train
from benchmarks.original import EPISODES
from drone_rl.utils.files import read_json

NETWORKS = {"lstm": "lstm", "memoryless": "small_cnn"}
"""Networks that learn a task that needs memory, by the first part of their key."""
_ROOT = Path(__file__).resolve().parents[1]


def bench_chapter(setup: Setup) -> dict[str, Any]:
    """Time `experiment=original`, and train networks with and without memory.

    Returns:
        "original_minutes": minutes of 30,000 episodes that stop for no criterion; "lstm_success",
        "memoryless_success", see `memory`.

    Raises:
        RuntimeError: A command failed.
    """
    folder = setup.runs / "chapter"
    return {
        "original_minutes": minutes(folder / "whole", 100 if setup.quick else EPISODES),
        **memory(folder / "memory", setup.quick),
    }


def memory(folder: Path, quick: bool) -> dict[str, float]:
    """Return the success of an LSTM and of a network without memory, of 1,000 greedy episodes.

    The task is that of `examples/recall.py`. Each is the median of three trainings.
    """
    paths = (str(_ROOT), os.environ.get("PYTHONPATH", ""))
    environment = {"PYTHONPATH": os.pathsep.join(filter(None, paths))}
    plugin, success = "plugins=[examples.recall]", {}
    limit = f"trainer.total_frames={2000 if quick else 400_000}"
    for key, network in NETWORKS.items():
        rates = []
        for seed in range(1 if quick else 3):
            run = folder / f"{key}_{seed}"
            settings = [plugin, "task=recall", f"network={network}", f"seed={seed}", limit]
            train(run, *settings, environment=environment)
            settings = [plugin, f"policy={run}", "seed=0", "episodes=1000"]
            folder_setting = f"hydra.run.dir={run}/evaluation"
            call("evaluate", *settings, folder_setting, environment=environment)
            evaluation = read_json(run / "evaluation" / "evaluation.json")
            rates.append(evaluation["greedy"]["success"]["share"])
        success[f"{key}_success"] = statistics.median(rates)
    return success


def minutes(folder: Path, episodes: int) -> float:
    """Return the minutes of 30,000 episodes, from so many that no criterion ends."""
    settings = ["experiment=original", "seed=0", "trainer.target_share=null"]
    seconds, _ = train(folder, *settings, f"trainer.total_episodes={episodes}")
    return seconds / 60 * EPISODES / episodes
