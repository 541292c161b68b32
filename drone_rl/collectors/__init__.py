"""From environment and policy to batches of experience."""

from drone_rl.collectors.episodes import EpisodeCollector
from drone_rl.collectors.rollouts import RolloutCollector
from drone_rl.collectors.threaded import ThreadedCollector
from drone_rl.collectors.worlds_collector import WorldsCollector, take_rows

__all__ = [
    "EpisodeCollector",
    "RolloutCollector",
    "ThreadedCollector",
    "WorldsCollector",
    "take_rows",
]
