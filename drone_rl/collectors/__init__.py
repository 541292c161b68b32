"""From environment and policy to batches of experience."""

from drone_rl.collectors.episodes import EpisodeCollector
from drone_rl.collectors.threaded import ThreadedCollector

__all__ = ["EpisodeCollector", "ThreadedCollector"]
