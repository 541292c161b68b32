"""Whole trainings by the commands that a user runs: time to solve, and success rate."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.benchmark import Setup
from benchmarks.commands import call, train
from drone_rl.utils.files import read_json


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


def bench_experiment(setup: Setup, experiment: str, num_seeds: int) -> dict[str, Any]:
    """Train an experiment from each seed and evaluate the greedy policies.

    Args:
        setup: The setup.
        experiment: Name of the experiment, and prefix of the figures' keys.
        num_seeds: Number of seeds, at most those of the setup.

    Returns:
        For each seed "..._time_to_solve_s", seconds until the command ends, "..._frames", and
        "..._success_lower95", the lower bound of the exact 95% interval of the success rate;
        "..._solved", the number of seeds that reached the target.
    """
    brief = ["trainer.total_frames=4000", "trainer.confirm_episodes=0"] if setup.quick else []
    settings = [f"experiment={experiment}", *brief]
    seeds = setup.seeds[:num_seeds]
    results = train_and_evaluate(setup, setup.runs / experiment, seeds, settings)
    return {
        f"{experiment}_time_to_solve_s": results["seconds"],
        f"{experiment}_frames": results["frames"],
        f"{experiment}_success_lower95": results["lower95"],
        f"{experiment}_solved": results["reason"].count("solved"),
    }


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
        of the training loop), "reason" and "lower95".
    """
    names = ("seconds", "frames", "trained_s", "reason", "lower95")
    results: dict[str, list] = {name: [] for name in names}
    for seed in seeds:
        run = folder / f"train_{seed}"
        seconds, result = train(run, f"seed={seed}", f"device={setup.device}", *settings)
        results["seconds"].append(seconds)
        results["frames"].append(result.frames)
        results["trained_s"].append(result.seconds)
        results["reason"].append(result.reason)
        results["lower95"].append(evaluate(setup, run)["lower95"])
    return results


def evaluate(setup: Setup, run: Path) -> dict[str, float]:
    """Evaluate the greedy policy of a run in held-out environments, by the command.

    Returns:
        The success rate, "share", and its exact 95% interval, "lower95" and "upper95".
    """
    folder = run / "evaluation"
    settings = ["seed=0", "baselines=false", "videos=0", f"device={setup.device}"]
    settings += [f"episodes={setup.episodes}", f"hydra.run.dir={folder}"]
    call("evaluate", f"checkpoint={run}", *settings)
    return read_json(folder / "evaluation.json")["greedy"]["success"]
