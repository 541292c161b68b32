"""Tune our learners and the third-party baselines: the same number of settings, the same seeds.

    python -m tools.tuning [NAME ...]

Each setting is trained from seeds that `drone-rl bench peers` does not use. A setting with an
unsolved training is excluded. `benchmarks/peers/settings.py` and `conf` have the setting with the
lowest mean time from the start of the process until solved. It takes half an hour on two cores.
"""

import json
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from statistics import mean
from typing import Any

from benchmarks.peers.comparison import train_ours, train_theirs

SEEDS = (100, 101)
MAX_FRAMES = 200_000
_PPO = "objective=ppo"
_SB3 = {"num_envs": 64, "n_steps": 64, "n_epochs": 4, "batch_size": 512, "ent_coef": 0.01}
OURS: Mapping[str, Sequence[str]] = {
    "reinforce": [
        "collector.num_envs=16 optimizer.lr=1e-3",
        "collector.num_envs=16 optimizer.lr=1.5e-3",
        "collector.num_envs=12 optimizer.lr=1e-3",
        "collector.num_envs=24 optimizer.lr=1.5e-3",
        "collector.num_envs=32 optimizer.lr=2e-3",
        "objective.entropy_coeff=0.02",
    ],
    "a2c": [
        "objective=a2c optimizer.lr=2e-3",
        "objective=a2c optimizer.lr=1e-3",
        "objective=a2c optimizer.lr=3e-3",
        "objective=a2c objective.num_steps=8 optimizer.lr=2e-3",
        "objective=a2c objective.num_steps=32 optimizer.lr=3e-3",
        "objective=a2c objective.num_steps=8 optimizer.lr=1e-3",
    ],
    "ppo": [
        f"{_PPO} optimizer.lr=2e-3",
        f"{_PPO} optimizer.lr=1e-3",
        f"{_PPO} optimizer.lr=3e-3",
        f"{_PPO} objective.epochs=4 optimizer.lr=1e-3",
        f"{_PPO} objective.epochs=1 optimizer.lr=3e-3",
        f"{_PPO} objective.num_steps=16 optimizer.lr=2e-3",
    ],
}
"""Arguments of `drone-rl train` for each of our learners."""
THEIRS: Mapping[str, Sequence[Mapping[str, Any]]] = {
    "sb3_ppo": [
        _SB3 | {"learning_rate": 1e-3},
        _SB3 | {"learning_rate": 2e-3, "n_epochs": 2},
        _SB3 | {"learning_rate": 2e-3, "n_epochs": 2, "n_steps": 32},
        _SB3 | {"learning_rate": 3e-3, "n_epochs": 2, "n_steps": 32},
        _SB3 | {"learning_rate": 2e-3, "n_epochs": 2, "n_steps": 32, "ent_coef": 0.0},
        _SB3 | {"learning_rate": 3e-3, "n_epochs": 1, "n_steps": 32},
    ],
    "sb3_a2c": [
        {"num_envs": 64},
        {"num_envs": 64, "learning_rate": 2e-3},
        {"num_envs": 64, "n_steps": 16},
        {"num_envs": 64, "n_steps": 16, "learning_rate": 2e-3},
        {"num_envs": 64, "n_steps": 16, "learning_rate": 2e-3, "use_rms_prop": False},
        {"num_envs": 16, "n_steps": 16},
    ],
    "torchrl": [
        {"num_envs": 16, "steps": 200, "lr": 2e-3},
        {"num_envs": 16, "steps": 200, "lr": 3e-3},
        {"num_envs": 32, "steps": 200, "lr": 3e-3},
        {"num_envs": 64, "steps": 200, "lr": 3e-3},
        {"num_envs": 32, "steps": 200, "lr": 2e-3},
        {"num_envs": 32, "steps": 150, "lr": 3e-3},
    ],
}
"""Settings of the learners of other libraries."""


def main(names: Sequence[str]) -> None:
    """Train with all settings of the named learners (default: all) and print a line for each."""
    with tempfile.TemporaryDirectory() as folder:
        for name in names or [*OURS, *THEIRS]:
            for settings in [*OURS.get(name, ()), *THEIRS.get(name, ())]:
                results = [_train(name, settings, seed, Path(folder)) for seed in SEEDS]
                print(name, json.dumps(settings), *_summary(results), flush=True)


def _train(name: str, settings: Any, seed: int, folder: Path) -> dict[str, Any]:
    if name in THEIRS:
        return train_theirs(name, settings, seed=seed, episodes=0, max_frames=MAX_FRAMES)
    arguments = [*settings.split(), f"trainer.total_frames={MAX_FRAMES}"]
    run_folder = folder / str(len(list(folder.iterdir())))
    return train_ours(arguments, seed=seed, episodes=0, folder=run_folder)


def _summary(results: Sequence[Mapping[str, Any]]) -> list[str]:
    mark = "" if all(one["is_solved"] for one in results) else " (not all solved)"
    seconds = [f"{one['seconds']:.1f}" for one in results]
    frames = [f"{one['frames']:,}" for one in results]
    average = mean(one["seconds"] for one in results)
    return [f"{average:.1f} s{mark}:", ", ".join(seconds), "s;", ", ".join(frames), "frames"]


if __name__ == "__main__":
    main(sys.argv[1:])
