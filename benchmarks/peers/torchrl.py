"""The example that trains with nothing but TorchRL's own collector, until it is solved."""

import importlib.util
from pathlib import Path
from types import ModuleType
from typing import Any

from benchmarks.peers.outcome import TARGET, PeerTraining
from drone_rl.policies.external_policy import policy_from
from drone_rl.utils.errors import InputError

EXAMPLE = Path(__file__).parents[2] / "examples" / "train_with_torchrl.py"
"""Which does not travel with the package."""


def train_torchrl(
    seed: int, *, target: float = TARGET, max_frames: int = 1_000_000, **settings: Any
) -> PeerTraining:
    """Trains until the running mean of the episodes' rewards has reached a target.

    Args:
        seed: Of worlds, weights and actions.
        target: Of the running mean.
        max_frames: It stops after so many in any case.
        settings: Of the example.

    Raises:
        InputError: The example is not there.
    """
    done = _example().train(seed=seed, target=target, max_frames=max_frames, **settings)
    reached = done.running_reward >= target
    policy = policy_from(done.network, name="torchrl's Collector")
    return PeerTraining(reached, done.frames, done.running_reward, policy)


def _example() -> ModuleType:
    spec = importlib.util.spec_from_file_location("train_with_torchrl", EXAMPLE)
    if not EXAMPLE.is_file() or spec is None or spec.loader is None:
        raise InputError(f"{EXAMPLE} is not there; measure in a clone of the repository")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
