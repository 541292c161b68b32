"""Settings of the compared learners: the fastest of six sets for each, with two other seeds."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

OURS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "reinforce": (),
        "a2c": ("objective=a2c", "objective.num_steps=32", "optimizer.lr=3e-3"),
        "ppo": ("objective=ppo", "objective.epochs=1", "optimizer.lr=3e-3"),
    }
)
"""Overrides of `drone-rl train` for this project's learners."""
THEIRS: Mapping[str, Mapping[str, Any]] = MappingProxyType(
    {
        "sb3_ppo": {
            "num_envs": 64,
            "n_steps": 32,
            "n_epochs": 1,
            "batch_size": 512,
            "ent_coef": 0.01,
            "learning_rate": 3e-3,
        },
        "sb3_a2c": {"num_envs": 64, "n_steps": 16, "learning_rate": 2e-3},
        "torchrl": {"num_envs": 32, "steps": 150, "lr": 3e-3},
    }
)
"""Settings of third-party learners that differ from their defaults."""
LABELS: Mapping[str, str] = MappingProxyType(
    {
        "reinforce": "drone_rl, REINFORCE (default)",
        "a2c": "drone_rl, A2C",
        "ppo": "drone_rl, PPO",
        "sb3_ppo": "Stable-Baselines3, PPO",
        "sb3_a2c": "Stable-Baselines3, A2C",
        "torchrl": "TorchRL's Collector, REINFORCE",
    }
)
"""Labels in figures and tables."""
