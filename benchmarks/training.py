"""Whole trainings by the commands that a user runs: time to solve, and success rate."""

from collections.abc import Iterable
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from benchmarks.benchmark import Setup
from benchmarks.commands import call, train
from drone_rl.utils.files import read_json

PRESETS = {"flight": 5, "pillars": 3, "flight_velocity": 3, "flight_pillars": 3, "robust": 3}
"""Presets of trainings with the number of their seeds."""


def bench_solve(setup: Setup) -> dict[str, Any]:
    """Train the default from each seed and evaluate the greedy policies.

    Returns:
        For each seed the seconds and frames until the command ends, and the lower bound of the
        exact 95% interval of the success rate; the median seconds; the number of seeds that
        reached the target; "learning_fps", the median frames per second of collection and updates
        together.
    """
    settings = ["experiment=smoke"] if setup.quick else []
    results = train_and_evaluate(setup, setup.runs, setup.seeds, settings)
    return {
        "time_to_solve_s": results["seconds"],
        "frames_to_solve": results["frames"],
        "learning_fps": float(np.median(np.divide(results["frames"], results["trained_s"]))),
        "success_lower95": results["lower95"],
        "median_time_to_solve_s": float(np.median(results["seconds"])),
        "seeds_solved": results["reason"].count("solved"),
        "seeds_tried": len(setup.seeds),
    }


def bench_seeds(setup: Setup) -> dict[str, Any]:
    """Train the default from 20 seeds that selected no setting, and evaluate the policies.

    Returns:
        The number of seeds that reach the target; for each seed the seconds and frames until the
        command ends, and the lower bound of the success rate.
    """
    settings, last = (["experiment=smoke"], 202) if setup.quick else ([], 220)
    results = train_and_evaluate(setup, setup.runs / "seeds", range(200, last), settings)
    return {
        "seeds_solved_of_20": results["reason"].count("solved"),
        "seeds_s": results["seconds"],
        "seeds_frames": results["frames"],
        "seeds_lower95": results["lower95"],
    }


def bench_large(setup: Setup) -> dict[str, Any]:
    """Train `experiment=large` for a fixed number of frames.

    Returns:
        Frames per second of collection and updates together, with cached kernels.
    """
    settings = ["experiment=large", f"device={setup.device}", "trainer.target_share=null"]
    settings.append(f"trainer.total_frames={500 if setup.quick else 20_000}")
    train(setup.runs / "large_first", *settings)
    _, result = train(setup.runs / "large", *settings)
    return {"learning_fps_large": result.frames / result.seconds}


def bench_presets(setup: Setup) -> dict[str, Any]:
    """Train `PRESETS` from their numbers of seeds, and evaluate the policies.

    Returns:
        For each preset lists with a value for each seed: "..._time_to_solve_s", seconds until the
        command ends, "..._frames", and "..._success_lower95", the lower bound of the exact 95%
        interval of the success rate; "..._solved", the number of seeds that reached the target; and
        "inputs_solve_s", the median seconds of each preset, None if a success rate is below 0.9.
    """
    brief = ["trainer.total_frames=4000", "trainer.confirm_episodes=0"] if setup.quick else []
    figures: dict[str, Any] = {"inputs_solve_s": {}}
    for preset, num_seeds in PRESETS.items():
        settings, seeds = [f"experiment={preset}", *brief], setup.seeds[:num_seeds]
        results = train_and_evaluate(setup, setup.runs / preset, seeds, settings)
        is_solved = min(results["share"]) >= 0.9
        figures["inputs_solve_s"][preset] = median(results["seconds"]) if is_solved else None
        figures |= {
            f"{preset}_time_to_solve_s": results["seconds"],
            f"{preset}_frames": results["frames"],
            f"{preset}_success_lower95": results["lower95"],
            f"{preset}_solved": results["reason"].count("solved"),
        }
    return figures


def train_and_evaluate(
    setup: Setup, folder: Path, seeds: Iterable[int], settings: Iterable[str]
) -> dict[str, list]:
    """Train from each seed and evaluate each policy, by the commands that a user runs.

    Args:
        setup: Device, and held-out episodes of each policy.
        folder: Folder of the runs.
        seeds: Seeds of the trainings.
        settings: Overrides of every training.

    Returns:
        Lists with a value for each seed: "seconds" of the command, "frames", "trained_s" (seconds
        of the training loop), "reason", and the success rate, "share", with its "lower95".
    """
    names = ("seconds", "frames", "trained_s", "reason", "share", "lower95")
    results: dict[str, list] = {name: [] for name in names}
    for seed in seeds:
        run = folder / f"train_{seed}"
        seconds, result = train(run, f"seed={seed}", f"device={setup.device}", *settings)
        results["seconds"].append(seconds)
        results["frames"].append(result.frames)
        results["trained_s"].append(result.seconds)
        results["reason"].append(result.reason)
        success = evaluate(setup, run)
        results["share"].append(success["share"])
        results["lower95"].append(success["lower95"])
    return results


def evaluate(setup: Setup, run: Path) -> dict[str, float]:
    """Evaluate the greedy policy of a run in held-out environments, by the command.

    Returns:
        The success rate, "share", and its exact 95% interval, "lower95" and "upper95".
    """
    folder = run / "evaluation"
    settings = ["seed=0", "baselines=false", "videos=0", f"device={setup.device}"]
    settings += [f"episodes={setup.episodes}", f"hydra.run.dir={folder}"]
    call("evaluate", f"policy={run}", *settings)
    return read_json(folder / "evaluation.json")["greedy"]["success"]
