"""Train with TorchRL's collector, by an example of the repository, until the task is solved."""

import importlib.util
from pathlib import Path
from types import ModuleType
from typing import Any

from benchmarks.peers.outcome import TARGET, PeerTraining
from drone_rl.policies.external_policy import policy_from
from drone_rl.utils.errors import InputError

EXAMPLE = Path(__file__).parents[2] / "examples" / "train_with_torchrl.py"
"""The example; it is not part of the package."""


def train_torchrl(
    seed: int, *, target: float = TARGET, max_frames: int = 1_000_000, **settings: Any
) -> PeerTraining:
    """Train until the running mean of episode rewards reaches a target.

    Args:
        seed: Seed of environments, weights and actions.
        target: Target of the running mean.
        max_frames: Stop after this number of frames in any case.
        settings: Settings of the example.

    Raises:
        InputError: The example does not exist.
    """
    done = _example().train(seed=seed, target=target, max_frames=max_frames, **settings)
    reached = done.running_reward >= target
    policy = policy_from(done.network, name="torchrl's Collector")
    return PeerTraining(reached, done.frames, done.history, policy)


def _example() -> ModuleType:
    spec = importlib.util.spec_from_file_location("train_with_torchrl", EXAMPLE)
    if not EXAMPLE.is_file() or spec is None or spec.loader is None:
        raise InputError(
            f"{EXAMPLE} does not exist; run the benchmark in a clone of the repository"
        )
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
