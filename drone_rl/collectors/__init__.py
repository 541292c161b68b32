"""From environment and policy to batches of experience."""

from drone_rl.collectors.collector import BatchedCollector as BatchedCollector
from drone_rl.collectors.collector import ThreadedCollector as ThreadedCollector
from drone_rl.collectors.episodes import EpisodeCollector as EpisodeCollector
from drone_rl.collectors.rollouts import RolloutCollector as RolloutCollector
