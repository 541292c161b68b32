"""From environment and policy to batches of experience."""

from drone_rl.collectors.episodes import EpisodeCollector

__all__ = ["EpisodeCollector"]
