"""From environment and policy to batches of experience."""

from drone_rl.collectors.batched_collector import BatchedCollector, take_rows
from drone_rl.collectors.episodes import EpisodeCollector
from drone_rl.collectors.rollouts import RolloutCollector
from drone_rl.collectors.threaded import ThreadedCollector

__all__ = [
    "BatchedCollector",
    "EpisodeCollector",
    "RolloutCollector",
    "ThreadedCollector",
    "take_rows",
]
